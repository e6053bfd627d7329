"""Speed and angle of a synchronous motor without a sensor: an extended Kalman filter.

After Simon, Optimal State Estimation (2006), example 13.1: a motor of two phases, of which voltages
and currents are measured. R = 2 ohm, L = 3 mH, flux 0.1 Wb, J = 2e-3, F = 1e-3, one pole pair.
"""

import numpy as np

from boresight import Input, Output, ops
from boresight.kalman import Kalman, Measurement, State

DT = 2e-4  # s
R, L, FLUX, J, F = 2.0, 3e-3, 0.1, 2e-3, 1e-3


class Pmsm(Kalman):
    """Two currents, speed [rad/s] and angle [half turns]."""

    inputs = tuple(
        Input(n, -32.0, 32.0, "V" if n[0] == "u" else "A") for n in ("ua", "ub", "ia_z", "ib_z")
    )
    states = (
        State("ia", -16.0, 16.0, "A", sd=0.5),
        State("ib", -16.0, 16.0, "A", sd=0.5),
        State("speed", -64.0, 64.0, "rad/s", sd=2.0),
        State("angle", -1.0, 1.0, "ht", sd=0.1),
    )
    outputs = (Output("speed", "rad/s", tolerance=1e-2), Output("angle", "ht", tolerance=1e-3))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        sine, cosine = ops.sincos_ht(x.angle)
        return {
            "ia": x.ia + DT / L * (u.ua - R * x.ia + FLUX * (x.speed * sine)),
            "ib": x.ib + DT / L * (u.ub - R * x.ib - FLUX * (x.speed * cosine)),
            "speed": (1 - DT * F / J) * x.speed
            + DT * 1.5 * FLUX / J * (x.ib * cosine - x.ia * sine),
            "angle": x.angle + DT / np.pi * x.speed,
        }

    def noise(self, x, u, p):
        """Noise of the voltages, of the load, of Euler's step."""
        return {"ia": 1e-4, "ib": 1e-4, "speed": 1e-3, "angle": 1e-9}

    def measure(self, x, u, p):
        return [Measurement(u.ia_z, x.ia, 0.01), Measurement(u.ib_z, x.ib, 0.01)]
