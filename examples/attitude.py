"""Attitude and gyro bias from gyro, accelerometer and magnetometer, written as a model.

Six error states and three scalar measurements: the specific force points up, and other
accelerations are noise; the field points north. Gates reject innovations beyond four standard
deviations, and fields of another strength. Outputs are those of the predicted state, which leave
the core before the measurements of this sample are processed, as those of `mekf`. The filter starts
level and pointing north, and finds the attitude within seconds. Unlike `mekf` it has no start in
any attitude, no restarts and no status words.
"""

from boresight import Input, Output, Param, ops
from boresight.kalman import Attitude, Kalman, Measurement, State, vector

GRAVITY = 9.81  #: m/s^2
FIELD = 48.0  #: uT, unit in which fields count.


class AttitudeFromModel(Kalman):
    """Attitude and gyro bias, six error states; three measurements, gated."""

    name = "attitude"
    inputs = (
        Input("dt", 0.0, 0.25, "s", clamp=True, meaning="time since the sample before"),
        *vector(Input, "g", "xyz", -40.0, 40.0, "rad/s"),
        *vector(Input, "m", "xyz", -256.0, 255.9, "uT", missing=0.0),
        *vector(Input, "a", "xyz", -160.0, 160.0, "m/s^2"),
    )
    params = (
        Param("acc_var", 1.0, 1e-3, 16.0, "", "variance of the specific force over g, at rest"),
        Param("mag_var", 1.0, 1e-3, 16.0, "", "variance of the field over 48 uT"),
        Param("gyro_var", 1e-4, 1e-7, 1e-2, "rad^2/s", "random walk of the attitude"),
        Param("bias_var", 1e-9, 1e-11, 1e-6, "rad^2/s^3", "random walk of the bias"),
        Param("north", 0.4, 0.1, 1.0, "", "horizontal field, over 48 uT"),
        Param("field_least", 1000.0, 1.0, 16384.0, "uT^2", "square of the weakest field used"),
        Param("field_most", 4000.0, 1.0, 16384.0, "uT^2", "square of the strongest field used"),
    )
    states = (
        Attitude("q", sd=(0.5, 0.5, 1.0)),
        *vector(State, "b", "xyz", -0.125, 0.125, "rad/s", sd=0.02),
    )
    outputs = (
        *(Output(name, "ht", tolerance=1e-4) for name in ("pitch", "roll", "heading")),
        *(Output("q" + c, tolerance=5e-5) for c in "wxyz"),
    )
    prior = True

    def f(self, x, u, p):
        """Rotation of one step, limited to half a radian."""
        pairs = zip(u.g, x.b, strict=True)
        return {"q": [ops.saturated(u.dt * (g - b), 0.5) for g, b in pairs]}

    def noise(self, x, u, p):
        return {"q": p.gyro_var * u.dt, "b": p.bias_var * u.dt}

    def measure(self, x, u, p):
        """The vertical by the force, north by the field, in navigation axes."""
        up, vertical = x.q.observed([c * (1.0 / GRAVITY) for c in u.a], (0.0, 0.0, 1.0))
        field, north = x.q.observed([c * (1.0 / FIELD) for c in u.m], (0.0, p.north, 0.0))
        up, east = [ops.saturated(c, 2.0) for c in up], ops.saturated(field[0], 2.0)
        uneven = ops.saturated(ops.absolute((u.a @ u.a) * (1.0 / GRAVITY**2) - 1.0), 1.0)
        strength = u.m @ u.m
        valid = (strength > p.field_least) & (strength < p.field_most)
        r = p.acc_var + uneven
        return [
            Measurement(up[0], vertical[0], r, gate=4.0),
            Measurement(up[1], vertical[1], r, gate=4.0),
            Measurement(east, north[0], p.mag_var, valid=valid, gate=4.0),
        ]

    def shown(self, x, u, p):
        (_, east, _), (_, north, _), (left, up, top) = x.q.matrix
        level = ops.sqrt(ops.bounded(left * left + top * top, 0.0, 1.0, "of a unit vector"))
        return {
            "pitch": ops.atan2_ht(up, level),
            "roll": ops.atan2_ht(-left, top),
            "heading": ops.atan2_ht(-east, north),
        }
