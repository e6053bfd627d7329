"""A body that falls through the air, from its distance alone: an extended Kalman filter.

After Athans, Wishner and Bertolini, IEEE Transactions on Automatic Control 13 (1968), 504-514: drag
c exp(-h / 6.1 km) v^2 with an unknown c; the radar stands 30 km beside the path, 30 km high.
"""

import numpy as np

from boresight import Input, Output, ops
from boresight.kalman import Kalman, Measurement, State

DT = 0.1  # s


class Falling(Kalman):
    """Height [km], velocity [km/s] and drag [1/km]."""

    inputs = (Input("z", 0.0, 128.0, "km"),)
    states = (
        State("h", 0.0, 128.0, "km", initial=90.5, sd=1.0),
        State("v", -8.0, 1.0, "km/s", initial=-5.8, sd=0.4),
        State("c", 0.0, 1.0, "1/km", initial=0.3, sd=0.2),
    )
    outputs = (
        Output("h", "km", tolerance=1e-4),
        Output("v", "km/s", tolerance=1e-4),
        Output("c", "1/km", tolerance=1e-3),
    )
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """Euler's step of h' = v, v' = drag - g."""
        drag = ops.exp(x.h * (-1.0 / 6.1)) * (x.c * x.v**2)
        return {"h": x.h + DT * x.v, "v": x.v + DT * (drag - 9.81e-3)}

    def noise(self, x, u, p):
        """Noise of the velocity, for the error of Euler's step, and of the drag."""
        return {"h": 1e-6, "v": 1e-5, "c": 1e-6}

    def measure(self, x, u, p):
        return [Measurement(u.z, np.hypot(30.0, x.h - 30.0), 9e-4)]
