"""Track of an aircraft from range and bearing: an extended Kalman filter.

After Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation
(2001), chapter 10: constant velocity, h(x) = (|p|, atan2(py, px)).
"""

import numpy as np

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT, Q = 0.5, 0.1  # s, m^2/s^3


class Radar(Kalman):
    """Position and velocity in the plane."""

    inputs = (Input("r", 0.0, 8000.0, "m"), Input("b", -3.2, 3.2, "rad"))
    states = (
        State("px", -4000.0, 4000.0, "m", initial=-2500.0, sd=100.0),
        State("py", 500.0, 4000.0, "m", initial=1500.0, sd=200.0),
        State("vx", -50.0, 50.0, "m/s", sd=20.0),
        State("vy", -50.0, 50.0, "m/s", sd=20.0),
    )
    outputs = (Output("px", "m", tolerance=0.05), Output("py", "m", tolerance=0.05))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        return {"px": x.px + DT * x.vx, "py": x.py + DT * x.vy}

    def noise(self, x, u, p):
        pos, vel, both = Q * DT**3 / 3, Q * DT, Q * DT**2 / 2
        return {"px": pos, "py": pos, "vx": vel, "vy": vel, ("px", "vx"): both, ("py", "vy"): both}

    def measure(self, x, u, p):
        """Range [m] and bearing [rad]."""
        return [
            Measurement(u.r, np.hypot(x.px, x.py), 100.0),
            Measurement(u.b, np.arctan2(x.py, x.px), 2.5e-5),
        ]
