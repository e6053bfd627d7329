"""Position and velocity of a ship from bearings alone: an extended Kalman filter.

After Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation
(2001), chapter 10. The observer swings across the line of sight, without which no bearing tells the
distance. The range of ``px`` keeps the ship ahead of the observer, so that the arc tangent has
finite derivatives.
"""

import numpy as np

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT = 0.5


class Bearing(Kalman):
    """Constant velocity; the observer's own position is known."""

    inputs = (Input("z", -3.2, 3.2, "rad"), Input("oy", -1000.0, 1000.0, "m"))
    states = (
        State("px", 1000.0, 6000.0, "m", initial=2950.0, sd=300.0),
        State("py", -3000.0, 3000.0, "m", initial=780.0, sd=100.0),
        State("vx", -16.0, 16.0, "m/s", sd=5.0),
        State("vy", -16.0, 16.0, "m/s", sd=5.0),
    )
    outputs = (Output("px", "m", tolerance=0.02), Output("py", "m", tolerance=0.02))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        return {"px": x.px + DT * x.vx, "py": x.py + DT * x.vy}

    def noise(self, x, u, p):
        return {"vx": 0.001, "vy": 0.001}

    def measure(self, x, u, p):
        return [Measurement(u.z, np.arctan2(x.py - u.oy, x.px), 4e-6, sd_max=0.05)]
