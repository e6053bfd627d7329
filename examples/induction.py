"""Rotor flux and speed of an induction motor without a sensor: an extended Kalman filter.

After Kim, Sul and Park, IEEE Transactions on Industry Applications 30 (1994), 1225-1233: currents
and rotor flux in stator axes, the speed as a constant with noise. Rs = 1.1 ohm, Rr / Lr = 20 / s,
Lm Rr / Lr = 3.2 ohm, leakage inductance 1 / 64 H, Lm / Lr over it 60.
"""

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT = 1e-4  # s


class Induction(Kalman):
    """Currents, flux and electrical speed."""

    inputs = (
        *(Input(n, -400.0, 400.0, "V") for n in ("ua", "ub")),
        *(Input(n, -100.0, 100.0, "A") for n in ("ia_z", "ib_z")),
    )
    states = (
        *(State(n, -100.0, 100.0, "A", sd=1.0) for n in ("ia", "ib")),
        *(State(n, -2.0, 2.0, "Wb", sd=0.05) for n in ("fa", "fb")),
        State("w", -500.0, 500.0, "rad/s", sd=20.0),
    )
    outputs = (
        *(Output(n, "Wb", tolerance=1e-4) for n in ("fa", "fb")),
        Output("w", "rad/s", tolerance=0.1),
    )
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """Euler's step of stator and rotor equations."""
        da, db = 20.0 * x.fa + x.w * x.fb, 20.0 * x.fb - x.w * x.fa
        return {
            "ia": x.ia + DT * (60.0 * da - 400.0 * x.ia + 64.0 * u.ua),
            "ib": x.ib + DT * (60.0 * db - 400.0 * x.ib + 64.0 * u.ub),
            "fa": x.fa + DT * (3.2 * x.ia - 20.0 * x.fa - x.w * x.fb),
            "fb": x.fb + DT * (3.2 * x.ib - 20.0 * x.fb + x.w * x.fa),
        }

    def noise(self, x, u, p):
        """Noise of currents and flux, for Euler's step; that of the speed follows a start."""
        return {"ia": 1e-3, "ib": 1e-3, "fa": 1e-7, "fb": 1e-7, "w": 1.0}

    def measure(self, x, u, p):
        return [Measurement(u.ia_z, x.ia, 0.04), Measurement(u.ib_z, x.ib, 0.04)]
