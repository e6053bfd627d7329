"""A car in the plane from satellite fixes, accelerometer and gyro: an extended Kalman filter.

After Farrell, Aided Navigation (2008), chapter 9: the inertial sensors drive the model at 50 Hz,
the fixes correct it once a second; the gyro's bias is a state.
"""

import numpy as np

from boresight import Input, Output, ops
from boresight.kalman import Kalman, Measurement, State

DT = 0.02  # s


class GpsImu(Kalman):
    """Position, speed, heading [half turns] and bias of the gyro."""

    inputs = (
        Input("acc", -16.0, 16.0, "m/s^2"),
        Input("rate", -2.0, 2.0, "rad/s"),
        Input("fx", -500.0, 500.0, "m", missing="hold"),
        Input("fy", -500.0, 500.0, "m", missing="hold"),
        Input("new", 0.0, 1.0, valid_of="fx"),
    )
    states = (
        State("px", -500.0, 500.0, "m", sd=3.0),
        State("py", -500.0, 500.0, "m", sd=3.0),
        State("speed", -4.0, 40.0, "m/s", initial=9.0, sd=2.0),
        State("heading", -1.0, 1.0, "ht", sd=0.1),
        State("bias", -0.25, 0.25, "rad/s", sd=0.03),
    )
    outputs = (
        *(Output(n, "m", tolerance=1e-3) for n in ("px", "py")),
        Output("speed", "m/s", tolerance=1e-3),
        Output("heading", "ht", tolerance=1e-4),
    )
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """p' = v (cos, sin), v' = acc, heading' = rate - bias."""
        sine, cosine = ops.sincos_ht(x.heading)
        return {
            "px": x.px + DT * (x.speed * cosine),
            "py": x.py + DT * (x.speed * sine),
            "speed": x.speed + DT * u.acc,
            "heading": x.heading + DT / np.pi * (u.rate - x.bias),
        }

    def noise(self, x, u, p):
        """Noise of accelerometer and gyro; drift of the bias."""
        return {"speed": 1e-4, "heading": 4e-9, "bias": 1e-10}

    def measure(self, x, u, p):
        new = u.new > 0.5
        return [Measurement(z, h, 2.25, valid=new) for z, h in ((u.fx, x.px), (u.fy, x.py))]
