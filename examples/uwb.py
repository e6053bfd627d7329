"""Position of a tag from its distances to four anchors: an extended Kalman filter.

After Sayed, Tarighat and Khajehnouri, IEEE Signal Processing Magazine 22 (2005), 24-40, with a
tracking filter in place of their least squares. The anchors hang 2 m above the tag, in the corners.
"""

import numpy as np

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT = 0.1  # s
ANCHORS = ((0.0, 0.0), (20.0, 0.0), (20.0, 12.0), (0.0, 12.0))  # m


class Uwb(Kalman):
    """Position and velocity in the plane."""

    inputs = tuple(Input(f"d{n}", 0.0, 32.0, "m") for n in range(4))
    states = (
        State("px", 0.0, 20.0, "m", initial=16.0, sd=2.0),
        State("py", 0.0, 12.0, "m", initial=7.0, sd=2.0),
        State("vx", -8.0, 8.0, "m/s", sd=1.0),
        State("vy", -8.0, 8.0, "m/s", sd=1.0),
    )
    outputs = (Output("px", "m", tolerance=1e-3), Output("py", "m", tolerance=1e-3))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        return {"px": x.px + DT * x.vx, "py": x.py + DT * x.vy}

    def noise(self, x, u, p):
        """Noise of a walking person."""
        return {"vx": 0.04, "vy": 0.04}

    def measure(self, x, u, p):
        """Four slant distances."""
        return [
            Measurement(
                getattr(u, f"d{n}"), np.sqrt((x.px - ax) ** 2 + (x.py - ay) ** 2 + 4.0), 0.01
            )
            for n, (ax, ay) in enumerate(ANCHORS)
        ]
