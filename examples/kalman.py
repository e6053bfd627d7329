"""Position and velocity of a cart from noisy positions: a Kalman filter of two states.

``kalman.csv`` is a cart that swings over 60 m, seen with half a metre of noise in steps of 8 to 12
ms, with its truth::

    boresight check kalman.py kalman.csv
    boresight accuracy kalman.py kalman.csv
    boresight tune kalman.py kalman.csv -o tuned.json

Jacobians, covariance, gains and their ranges are derived from the model.
"""

from boresight import Input, Output, Param, kalman


class Kalman(kalman.Kalman):
    """Constant velocity, driven by white acceleration."""

    inputs = (Input("dt", 0.0, 0.1, "s"), Input("z", -100.0, 100.0, "m"))
    params = (
        Param("r", 0.25, 0.01, 4.0, "m^2", "variance of a measured position"),
        Param("q", 0.5, 0.001, 8.0, "m^2/s^3", "density of the acceleration"),
    )
    states = (
        kalman.State("pos", -128.0, 128.0, "m", sd=2.0, sd_max=2.8),
        kalman.State("vel", -64.0, 64.0, "m/s", sd=2.0, sd_max=2.8),
    )
    outputs = (Output("pos", "m", tolerance=1e-4), Output("vel", "m/s", tolerance=1e-4))

    def f(self, x, u, p):
        """A step of dt."""
        return {"pos": x.pos + u.dt * x.vel}

    def noise(self, x, u, p):
        """Variance that a step adds to the velocity."""
        return {"vel": u.dt * p.q}

    def measure(self, x, u, p):
        """The position."""
        return [kalman.Measurement(u.z, x.pos, p.r)]
