"""Angle and rate of a pendulum from the bob's sideways position: an extended Kalman filter.

After Särkkä, Bayesian Filtering and Smoothing (2013), example 5.1::

    boresight check pendulum.py worlds.py:Pendulum

The Jacobians are derived: by the sine, F and H depend on the angle. Where the bob is at its turning
point the derivative of the measurement is near zero and it says nothing.
"""

import numpy as np

from boresight import Input, Output, Param
from boresight.kalman import Kalman, Measurement, State

DT = 0.01


class Pendulum(Kalman):
    """One metre long, lightly damped, seen from above."""

    inputs = (Input("z", -1.25, 1.25, "m"),)
    params = (
        Param("stiffness", 9.81, 5.0, 15.0, "1/s^2", "gravity over length"),
        Param("damping", 0.1, 0.0, 1.0, "1/s", "share of the rate that is lost in a second"),
        Param("r", 4e-4, 1e-4, 1e-2, "m^2", "variance of a position"),
        Param("q", 0.01, 1e-4, 1.0, "1/s^3", "density of the acceleration"),
    )
    states = (
        State("angle", -2.0, 2.0, "rad", initial=0.5, sd=0.5, sd_max=0.7),
        State("rate", -8.0, 8.0, "rad/s", sd=1.0, sd_max=1.4),
    )
    outputs = (Output("angle", "rad", tolerance=1e-5), Output("rate", "rad/s", tolerance=1e-4))
    floor = 0.0  # the noise of the rate reaches the angle

    def f(self, x, u, p):
        """Semi-implicit Euler."""
        rate = (1.0 - DT * p.damping) * x.rate - DT * (p.stiffness * np.sin(x.angle))
        return {"angle": x.angle + DT * rate, "rate": rate}

    def noise(self, x, u, p):
        return {"rate": DT * p.q}

    def measure(self, x, u, p):
        return [Measurement(u.z, np.sin(x.angle), p.r)]
