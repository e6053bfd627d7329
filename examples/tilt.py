"""Roll and pitch from gyro and accelerometer: an error-state Kalman filter.

After Markley, Journal of Guidance, Control, and Dynamics 26 (2003), 311-317: a unit quaternion with
an error of three components, and the gyro's bias. The accelerometer shows where up is.
"""

from boresight import Input, Output, ops
from boresight.kalman import Attitude, Kalman, Measurement, State, vector

DT, G = 0.01, 9.81  # s, m/s^2


class Tilt(Kalman):
    """Attitude and bias; without a compass, heading is not observed."""

    inputs = (
        *vector(Input, "g", "xyz", -10.0, 10.0, "rad/s"),
        *vector(Input, "a", "xyz", -40.0, 40.0, "m/s^2"),
    )
    states = (
        Attitude("q", sd=(0.2, 0.2, 0.05)),
        *vector(State, "b", "xyz", -0.125, 0.125, "rad/s", sd=0.02),
    )
    outputs = (Output("roll", "ht", tolerance=1e-4), Output("pitch", "ht", tolerance=1e-4))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        return {"q": DT * (u.g - x.b)}

    def noise(self, x, u, p):
        return {"q": 1e-8, "b": 1e-10}

    def measure(self, x, u, p):
        """The specific force, over g, points up."""
        z, h = x.q.observed(u.a * (1.0 / G), (0.0, 0.0, 1.0))
        return [Measurement(z[n], h[n], 3e-4) for n in range(2)]

    def shown(self, x, u, p):
        """Euler angles of the third row, the direction of up."""
        left, up, top = x.q.matrix[2]
        level = ops.sqrt(ops.bounded(up * up + top * top, 0.0, 1.0, "of a unit vector"))
        return {"roll": ops.atan2_ht(up, top), "pitch": ops.atan2_ht(-left, level)}
