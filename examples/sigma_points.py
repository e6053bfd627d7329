"""The pendulum by sigma points: an unscented Kalman filter.

After Julier and Uhlmann, Proceedings of the IEEE 92 (2004), 401-422, with n = 2, kappa = 1: points
x, x +- the columns of sqrt(3 P), weights 1/3 and 1/6. No Jacobian is needed; the root is that of
Cholesky, L L' = 3 P.
"""

import numpy as np

from boresight import Estimator, Input, Output, State, ops

DT, R = 0.01, 4e-4  # s, m^2
WEIGHTS = np.array([1 / 3, 1 / 6, 1 / 6, 1 / 6, 1 / 6])


def moved(points):
    """Semi-implicit Euler of angle'' = -9.81 sin(angle) - 0.1 angle'."""
    rate = (1 - 0.1 * DT) * points[1] - 9.81 * DT * np.sin(points[0])
    return np.array([points[0] + DT * rate, rate])


def within(x, largest):
    """Bounds of deviations and gains: sqrt(3 P), sqrt(P / R) / 2."""
    return ops.bounded(x, -largest, largest, "Cauchy and Schwarz")


class SigmaPoints(Estimator):
    """Angle and rate of a pendulum from the bob's sideways position."""

    inputs = (Input("z", -1.25, 1.25, "m"),)
    states = (
        State("angle", -2.0, 2.0, "rad", 0.5),
        State("rate", -8.0, 8.0, "rad/s"),
        State("p00", 0.0, 0.25, "rad^2", 0.0625),
        State("p01", -0.25, 0.25, "rad^2/s"),
        State("p11", 0.0, 0.5, "rad^2/s^2", 0.25),
    )
    outputs = (Output("angle", "rad", tolerance=1e-4), Output("rate", "rad/s", tolerance=1e-3))

    def step(self, x, u, p):
        a = ops.sqrt(3 * ops.maximum(x.p00, 1e-5))
        b = ops.bounded(3 * x.p01 / a, -1.25, 1.25, "sqrt(3 p11)")
        c = ops.sqrt(ops.maximum(3 * x.p11 - b * b, 1e-4))
        points = moved(np.array([x.angle + np.array([0, a, 0, -a, 0]),
                                 x.rate + np.array([0, b, c, -b, -c])]))  # fmt: skip
        seen = np.sin(points[0])
        mean, expected = points @ WEIGHTS, seen @ WEIGHTS
        d, e = points - mean[:, None], seen - expected
        d, e = (np.vectorize(within, otypes=[object])(values, 2.0) for values in (d, e))
        s = ops.bounded((WEIGHTS * e) @ e + R, R, 0.5 + R, "P + R")
        cross = d @ (WEIGHTS * e)
        gain = np.array([within(k, 16.0) for k in cross / s])
        cov = (WEIGHTS * d) @ d.T + np.diag([1e-5, 1e-3]) - np.outer(gain, cross)
        angle, rate = mean + gain * (u.z - expected)
        after = {"angle": angle, "rate": rate, "p00": cov[0, 0], "p01": cov[0, 1], "p11": cov[1, 1]}
        return after, {"angle": angle, "rate": rate}
