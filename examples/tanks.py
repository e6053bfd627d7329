"""Levels of two tanks above each other from a gauge on the lower one: an extended Kalman filter.

After Johansson, IEEE Transactions on Control Systems Technology 8 (2000), 456-465, one side of his
four tanks: h1' = (pump - a1 sqrt(2 g h1)) / A1, h2' = (a1 sqrt(2 g h1) - a2 sqrt(2 g h2)) / A2.
"""

from boresight import Input, Output, ops
from boresight.kalman import Kalman, Measurement, State

DT, G2 = 1.0, 1962.0  # s, cm/s^2


class Tanks(Kalman):
    """Two levels."""

    inputs = (Input("pump", 0.0, 128.0, "cm^3/s"), Input("z", -1.0, 40.0, "cm"))
    states = (
        State("h1", 1.0, 40.0, "cm", initial=12.0, sd=4.0),
        State("h2", 1.0, 40.0, "cm", initial=11.0, sd=2.0),
    )
    outputs = (Output("h1", "cm", tolerance=1e-3), Output("h2", "cm", tolerance=1e-3))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """Inflow less Torricelli's outflow."""
        q1, q2 = 0.5 * ops.sqrt(G2 * x.h1), 0.45 * ops.sqrt(G2 * x.h2)
        return {"h1": x.h1 + DT / 28.0 * (u.pump - q1), "h2": x.h2 + DT / 32.0 * (q1 - q2)}

    def noise(self, x, u, p):
        """Noise of waves and of Euler's step."""
        return {"h1": 1e-3, "h2": 1e-3}

    def measure(self, x, u, p):
        return [Measurement(u.z, x.h2, 0.01)]
