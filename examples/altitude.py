"""Height of a drone from accelerometer, barometer and lidar: rates, a delay and outliers.

After Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems (2013),
chapters 3, 6 and 17: the accelerometer is an input of the model, its bias a state; the late
barometer is compared with the height of then; innovations beyond the gate are left out.
"""

from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

DT, DELAY = 0.01, 0.12  # s


class Altitude(Kalman):
    """Height, its rate, and the accelerometer's bias."""

    inputs = (
        Input("acc", -40.0, 40.0, "m/s^2"),
        Input("baro", -100.0, 500.0, "m", missing="hold"),
        Input("baro_new", 0.0, 1.0, valid_of="baro"),
        Input("lidar", 0.0, 50.0, "m", missing="hold"),
        Input("lidar_new", 0.0, 1.0, valid_of="lidar"),
    )
    states = (
        State("h", -64.0, 512.0, "m", initial=10.0, sd=4.0),
        State("v", -32.0, 32.0, "m/s", sd=4.0),
        State("b", -2.0, 2.0, "m/s^2", sd=0.5),
    )
    outputs = tuple(
        Output(n, s, tolerance=1e-3) for n, s in (("h", "m"), ("v", "m/s"), ("b", "m/s^2"))
    )
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        """h' = v, v' = acc - b."""
        a = u.acc - x.b
        return {"h": x.h + DT * x.v + 0.5 * DT**2 * a, "v": x.v + DT * a}

    def noise(self, x, u, p):
        """Noise of the accelerometer, drift of its bias."""
        return {"v": (0.15 * DT) ** 2, "b": 1e-6}

    def measure(self, x, u, p):
        """The barometer is late."""
        return [
            Measurement(u.baro, x.h, 0.0625, valid=u.baro_new > 0.5, delay=DELAY),
            Measurement(u.lidar, x.h, 9e-4, valid=u.lidar_new > 0.5, gate=5.0),
        ]
