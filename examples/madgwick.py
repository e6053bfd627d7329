"""Attitude of gyro and accelerometer after Madgwick (2010), six axes.

``madgwick.csv`` is a hand that turns a sensor at 100 Hz, with the true attitude. The package
``ahrs`` has the same filter in floating point (`ahrs.filters.Madgwick`). Here the step shrinks near
level; with the same step, the quaternions agree within 1e-6::

    boresight check madgwick.py:Madgwick madgwick.csv
    boresight accuracy madgwick.py:Madgwick madgwick.csv

Vectors are normalised by an inverse root. `ops.bounded` states that the results are unit vectors,
which interval arithmetic cannot know.
"""

from boresight import Estimator, Input, Output, Param, State, ops

Q = ("qw", "qx", "qy", "qz")


class Madgwick(Estimator):
    """Gradient descent against gravity.

    The step has a constant length above a gradient of 0.02. Below, it shrinks with the gradient,
    so that the argument of the root is at least 4e-4, of a range up to 16.
    """

    inputs = (
        Input("dt", 0.0, 0.04, "s"),
        *(Input(f"g{a}", -8.0, 8.0, "rad/s") for a in "xyz"),
        *(Input(f"a{a}", -40.0, 40.0, "m/s^2") for a in "xyz"),
    )
    params = (Param("beta", 0.1, 0.0, 1.0, "rad/s", "speed of the correction"),)
    states = tuple(State(n, -1.0, 1.0, initial=float(n == "qw")) for n in Q)
    outputs = tuple(Output(n, tolerance=1e-5) for n in Q)

    def step(self, x, u, p):
        w, a, b, c = x.qw, x.qx, x.qy, x.qz
        norm = ops.rsqrt(u.ax * u.ax + u.ay * u.ay + u.az * u.az)
        ax, ay, az = (
            ops.bounded(v * norm, -1.0, 1.0, "unit vector", unless="it falls freely")
            for v in (u.ax, u.ay, u.az)
        )
        fx = ops.bounded(2.0 * (a * c - w * b) - ax, -2.0, 2.0, "two unit vectors")
        fy = ops.bounded(2.0 * (w * a + b * c) - ay, -2.0, 2.0, "two unit vectors")
        fz = ops.bounded(1.0 - 2.0 * (a * a + b * b) - az, -2.0, 2.0, "two unit vectors")
        gradient = [
            ops.bounded(0.5 * g, -2.0, 2.0, "half of |J| |f| <= 2 * 2")
            for g in (
                a * fy - b * fx,
                c * fx + w * fy - 2.0 * (a * fz),
                c * fy - w * fx - 2.0 * (b * fz),
                a * fx + b * fy,
            )
        ]
        squares = gradient[0] * gradient[0] + gradient[1] * gradient[1]
        squares = squares + gradient[2] * gradient[2] + gradient[3] * gradient[3]
        scale = ops.rsqrt(ops.clip(squares, 4e-4, 16.0))
        descent = [p.beta * ops.bounded(g * scale, -1.0, 1.0, "unit length") for g in gradient]
        gx, gy, gz = 0.5 * u.gx, 0.5 * u.gy, 0.5 * u.gz
        rate = (
            -a * gx - b * gy - c * gz,
            w * gx + b * gz - c * gy,
            w * gy - a * gz + c * gx,
            w * gz + a * gy - b * gx,
        )
        q = [
            ops.bounded(v + u.dt * (r - d), -1.25, 1.25, "a turn of 0.2 rad at most")
            for v, r, d in zip((w, a, b, c), rate, descent, strict=True)
        ]
        norm = ops.rsqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        q = [ops.clip(v * norm, -1.0, 1.0) for v in q]
        after = dict(zip(Q, q, strict=True))
        return after, after
