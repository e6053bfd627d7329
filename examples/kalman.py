"""Position and velocity of a cart from noisy positions: a Kalman filter of two states.

``kalman.csv`` is a cart that swings over 60 m, seen with half a metre of noise in steps of 8 to 12
ms, with its truth::

    boresight check kalman.py kalman.csv
    boresight accuracy kalman.py kalman.csv
    boresight tune kalman.py kalman.csv -o tuned.json

P is three numbers, since it is symmetric. The gains are bounded by what intervals do not know:
p00 / (p00 + r) is below 1, and r has a least value.
"""

from boresight import Estimator, Input, Output, Param, State, ops


class Kalman(Estimator):
    """Constant velocity, driven by white acceleration."""

    inputs = (Input("dt", 0.0, 0.1, "s"), Input("z", -100.0, 100.0, "m"))
    params = (
        Param("r", 0.25, 0.01, 4.0, "m^2", "variance of a measured position"),
        Param("q", 0.5, 0.001, 8.0, "m^2/s^3", "density of the acceleration"),
    )
    states = (
        State("pos", -128.0, 128.0, "m"),
        State("vel", -64.0, 64.0, "m/s"),
        State("p00", 0.0, 8.0, "m^2", initial=4.0),
        State("p01", -8.0, 8.0, "m^2/s"),
        State("p11", 0.0, 8.0, "m^2/s^2", initial=4.0),
    )
    outputs = (Output("pos", "m", tolerance=1e-4), Output("vel", "m/s", tolerance=1e-4))

    def step(self, x, u, p):
        """Predict, then correct."""
        dt = u.dt
        pos = x.pos + dt * x.vel
        p00 = x.p00 + dt * (2.0 * x.p01 + dt * x.p11)
        p01 = x.p01 + dt * x.p11
        p11 = x.p11 + dt * p.q
        weight = 1.0 / ops.clip(p00 + p.r, 0.01, 16.0)
        k0 = ops.bounded(p00 * weight, 0.0, 1.0, "p00 <= p00 + r")
        k1 = ops.bounded(p01 * weight, -16.0, 16.0, "the least r bounds it")
        innovation = u.z - pos
        pos = pos + k0 * innovation
        vel = x.vel + k1 * innovation
        after = {
            "pos": pos,
            "vel": vel,
            "p00": p00 - k0 * p00,
            "p01": p01 - k0 * p01,
            "p11": p11 - k1 * p01,
        }
        return after, {"pos": pos, "vel": vel}
