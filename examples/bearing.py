"""Position and velocity of a ship from bearings alone: an extended Kalman filter.

The observer swings across the line of sight, without which no bearing tells the distance. The
bearing is derived and wrapped as an angle; the range of ``px`` keeps the ship ahead of the
observer, so that the arc tangent has finite derivatives.
"""

import numpy as np

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT = 0.1


class Bearing(Kalman):
    """Constant velocity; the observer's own position is known."""

    inputs = (Input("z", -3.2, 3.2, "rad"), Input("oy", -100.0, 100.0, "m"))
    states = (
        State("px", 200.0, 800.0, "m", initial=320.0, sd=30.0, sd_max=40.0),
        State("py", -500.0, 500.0, "m", initial=80.0, sd=30.0, sd_max=40.0),
        State("vx", -16.0, 16.0, "m/s", sd=2.0, sd_max=4.0),
        State("vy", -16.0, 16.0, "m/s", sd=2.0, sd_max=4.0),
    )
    outputs = (Output("px", "m", tolerance=0.02), Output("py", "m", tolerance=0.02))

    def f(self, x, u, p):
        """A step of DT."""
        return {"px": x.px + DT * x.vx, "py": x.py + DT * x.vy}

    def noise(self, x, u, p):
        """Variances of the velocity that a step adds."""
        return {"vx": 0.001, "vy": 0.001}

    def measure(self, x, u, p):
        """The bearing, rad."""
        return [Measurement(u.z, np.arctan2(x.py - u.oy, x.px), 1e-4)]
