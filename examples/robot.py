"""Pose of a robot with two wheels from odometry and landmarks: an extended Kalman filter.

After Thrun, Burgard and Fox, Probabilistic Robotics (2005), section 7.4: velocity model, range and
bearing to a landmark at a known position. The landmarks stand at the far wall, where the robot
never is: so the arc tangent has finite derivatives.
"""

import numpy as np

from boresight import Input, Output, ops
from boresight.kalman import Kalman, Measurement, State

DT = 0.1  # s


class Robot(Kalman):
    """Position [m] and heading [half turns]."""

    inputs = (
        Input("speed", -2.0, 2.0, "m/s"),
        Input("turn", -2.0, 2.0, "rad/s"),
        Input("lx", -4.0, 14.0, "m"),
        Input("ly", 11.0, 15.0, "m"),
        Input("distance", 0.0, 24.0, "m"),
        Input("bearing", -1.0, 1.0, "ht"),
    )
    states = (
        State("px", 0.0, 10.0, "m", initial=5.1, sd=0.5),
        State("py", 0.0, 10.0, "m", initial=1.8, sd=0.5),
        State("heading", -1.0, 1.0, "ht", sd=0.1),
    )
    outputs = (
        *(Output(n, "m", tolerance=1e-3) for n in ("px", "py")),
        Output("heading", "ht", tolerance=1e-4),
    )
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        sine, cosine = ops.sincos_ht(x.heading)
        way, turn = DT * u.speed, DT / np.pi * u.turn
        return {"px": x.px + way * cosine, "py": x.py + way * sine, "heading": x.heading + turn}

    def noise(self, x, u, p):
        return {"px": 2.5e-5, "py": 2.5e-5, "heading": (0.02 * DT / np.pi) ** 2}

    def measure(self, x, u, p):
        """Distance and bearing of this sample's landmark."""
        dx, dy = u.lx - x.px, u.ly - x.py
        return [
            Measurement(u.distance, np.hypot(dx, dy), 2.5e-3),
            Measurement(u.bearing, ops.atan2_ht(dy, dx) - x.heading, (0.02 / np.pi) ** 2),
        ]
