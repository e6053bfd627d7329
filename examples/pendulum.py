"""Angle and rate of a pendulum from the bob's sideways position: an extended Kalman filter.

``pendulum.csv`` is a pendulum that is pushed now and then, seen with 2 cm of noise, with its
truth::

    boresight check pendulum.py pendulum.csv
    boresight accuracy pendulum.py pendulum.csv
    boresight covariance pendulum.py --updates 200000

The Jacobians are written out: F = [[1 + dt f10, dt f11], [f10, f11]], H = [cos(angle), 0]. Where
the bob is at its turning point H is near zero and the measurement says nothing; the divisor is
limited from below by the least r.
"""

from boresight import Estimator, Input, Output, Param, State, ops

PI = 3.141592653589793
DT = 0.01


class Pendulum(Estimator):
    """One metre long, lightly damped, seen from above."""

    inputs = (Input("z", -1.25, 1.25, "m"),)
    params = (
        Param("stiffness", 9.81, 5.0, 15.0, "1/s^2", "gravity over length"),
        Param("damping", 0.1, 0.0, 1.0, "1/s", "share of the rate that is lost in a second"),
        Param("r", 4e-4, 1e-4, 1e-2, "m^2", "variance of a position"),
        Param("q", 0.01, 1e-4, 1.0, "1/s^3", "density of the acceleration"),
    )
    states = (
        State("angle", -2.0, 2.0, "rad", initial=0.5),
        State("rate", -8.0, 8.0, "rad/s"),
        State("p00", 0.0, 0.5, "rad^2", initial=0.25),
        State("p01", -1.0, 1.0, "rad^2/s"),
        State("p11", 0.0, 2.0, "rad^2/s^2", initial=1.0),
    )
    outputs = (Output("angle", "rad", tolerance=1e-5), Output("rate", "rad/s", tolerance=1e-4))

    def step(self, x, u, p):
        """Semi-implicit Euler and its Jacobian, then one scalar measurement."""
        sine, cosine = ops.sincos_ht(x.angle * (1.0 / PI))
        f10 = -DT * (p.stiffness * cosine)
        f11 = 1.0 - DT * p.damping
        rate = f11 * x.rate - DT * (p.stiffness * sine)
        angle = x.angle + DT * rate
        f00, f01 = 1.0 + DT * f10, DT * f11
        a00, a01 = f00 * x.p00 + f01 * x.p01, f00 * x.p01 + f01 * x.p11
        a10, a11 = f10 * x.p00 + f11 * x.p01, f10 * x.p01 + f11 * x.p11
        p00 = f00 * a00 + f01 * a01
        p01 = f10 * a00 + f11 * a01
        p11 = f10 * a10 + f11 * a11 + DT * p.q
        sine, h = ops.sincos_ht(angle * (1.0 / PI))
        weight = 1.0 / ops.clip(h * h * p00 + p.r, 1e-4, 0.6)
        k0 = ops.bounded(h * p00 * weight, -64.0, 64.0, "sqrt(p00 / r) / 2")
        k1 = ops.bounded(h * p01 * weight, -128.0, 128.0, "sqrt(p11 / r) / 2")
        innovation = u.z - sine
        angle = angle + k0 * innovation
        rate = rate + k1 * innovation
        after = {
            "angle": angle,
            "rate": rate,
            "p00": p00 - k0 * h * p00,
            "p01": p01 - k0 * h * p01,
            "p11": p11 - k1 * h * p01,
        }
        return after, {"angle": angle, "rate": rate}
