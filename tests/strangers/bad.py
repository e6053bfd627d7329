"""Estimators that look right and are wrong in fixed point, one fault each.

The line to blame carries ``# FAULT``.
"""

from boresight import Estimator, Input, Output, State, ops


class Integrator(Estimator):
    """Adds up an offset for ever."""

    inputs = (Input("rate", -10.0, 10.0, "deg/s"),)
    states = (State("angle", -45.0, 45.0, "deg"),)
    outputs = (Output("angle", "deg", tolerance=0.01),)

    def step(self, x, u, p):
        """No limit."""
        angle = x.angle + 0.01 * u.rate  # FAULT
        return {"angle": angle}, {"angle": angle}


class Hope(Estimator):
    """A correlation that is not normalised after all."""

    inputs = (Input("a", -2.0, 2.0), Input("b", -2.0, 2.0))
    outputs = (Output("c", tolerance=1e-3),)

    def step(self, x, u, p):
        """Product."""
        c = ops.bounded(u.a * u.b, -1.0, 1.0, "both are small")  # FAULT
        return {}, {"c": 0.5 * c}


class NegativeRoot(Estimator):
    """The third side of a triangle that does not close."""

    inputs = (Input("c", 0.0, 10.0, "m"), Input("a", 0.0, 10.0, "m"))
    outputs = (Output("b", "m", tolerance=1e-2),)

    def step(self, x, u, p):
        """Pythagoras."""
        square = ops.bounded(u.c * u.c - u.a * u.a, 0.0, 100.0, "c is the longest")  # FAULT
        return {}, {"b": ops.sqrt(square)}  # FAULT


class SmallDivisor(Estimator):
    """Time to contact: the range over a speed that comes near zero."""

    inputs = (Input("range", 0.0, 100.0, "m"), Input("speed", 0.0, 100.0, "m/s"))
    outputs = (Output("time", "s", tolerance=0.1),)

    def step(self, x, u, p):
        """No more than 50 s."""
        reciprocal = 1.0 / ops.clip(u.speed, 1e-4, 100.0)  # FAULT
        return {}, {"time": ops.bounded(u.range * reciprocal, 0.0, 50.0, "near enough")}  # FAULT


class CoarseFilter(Estimator):
    """A slow average, too slow for a word of 18 bits."""

    inputs = (Input("x", -100.0, 100.0, "V"),)
    states = (State("mean", -100.0, 100.0, "V"),)
    outputs = (Output("mean", "V", tolerance=0.01),)

    def step(self, x, u, p):
        """A time constant of 1,000 samples."""
        mean = x.mean + 1e-3 * (u.x - x.mean)  # FAULT
        return {"mean": mean}, {"mean": mean}
