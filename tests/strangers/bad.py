"""Estimators that look right and are wrong in fixed point, one fault each.

The line to blame carries ``# FAULT``.
"""

from boresight import Estimator, Input, Output, Param, State, ops


class FlatGradient(Estimator):
    """Normalises a gradient that vanishes at the goal: below the floor of the root."""

    inputs = (Input("gx", -1.0, 1.0), Input("gy", -1.0, 1.0))
    outputs = (Output("nx", tolerance=1e-3), Output("ny", tolerance=1e-3))

    def step(self, x, u, p):
        """A unit vector."""
        squares = u.gx * u.gx + u.gy * u.gy
        nx, ny = (
            ops.bounded(g * ops.rsqrt(squares), -1.0, 1.0, "unit vector")  # FAULT
            for g in (u.gx, u.gy)
        )
        return {}, {"nx": nx, "ny": ny}


class Integrator(Estimator):
    """Adds up an offset for ever."""

    inputs = (Input("rate", -10.0, 10.0, "deg/s"),)
    states = (State("angle", -45.0, 45.0, "deg"),)
    outputs = (Output("angle", "deg", tolerance=0.01),)

    def step(self, x, u, p):
        """No limit."""
        angle = x.angle + 0.01 * u.rate  # FAULT
        return {"angle": angle}, {"angle": angle}


class NarrowState(Estimator):
    """The speed of something faster than its author thought."""

    inputs = (Input("force", -10.0, 10.0, "N"),)
    states = (State("speed", -2.0, 2.0, "m/s"), State("place", -512.0, 512.0, "m"))
    outputs = (Output("place", "m", tolerance=0.01),)

    def step(self, x, u, p):
        """Mass of 1 kg, friction of 1 kg/s."""
        speed = 0.99 * x.speed + 0.01 * u.force  # FAULT
        return {"speed": speed, "place": x.place + 0.01 * x.speed}, {"place": x.place}


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


class WideSine(Estimator):
    """An arc sine of more than its table holds."""

    inputs = (Input("s", 0.0, 1.0),)
    outputs = (Output("angle", "ht", tolerance=1e-3),)

    def step(self, x, u, p):
        """Up to a right angle, the author hopes."""
        return {}, {"angle": ops.asin_ht(ops.saturated(u.s, 1.0))}  # FAULT


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


class Vanishing(Estimator):
    """Adds increments below the last bit of what they are added to."""

    inputs = (Input("rate", 0.0, 1.0, "1/s"), Input("gain", 0.0, 1.0))
    params = (Param("dt", 1e-6, 0.0, 1e-3, "s", "time step"),)
    states = (
        State("gain", 0.0, 1.0, initial=0.5),
        State("smooth", 0.0, 1.0, "1/s"),
        State("count", 0.0, 1e4),
    )
    outputs = (Output("count", tolerance=1e-4), Output("period", "s", tolerance=1e-6))

    def step(self, x, u, p):
        """A microsecond at a time."""
        count = x.count + u.rate * p.dt  # FAULT
        smooth = ops.clip(x.smooth + x.gain * (u.rate - x.smooth), 0.0, 1.0)
        after = {"gain": u.gain, "smooth": smooth, "count": count}
        return after, {"count": count, "period": 2.0 / (smooth + 0.5)}


class Windup(Estimator):
    """A controller whose integral has no limit and is no output."""

    inputs = (Input("error", -20.0, 20.0, "K"),)
    params = (Param("ki", 0.01, 0.0, 0.1, "", "share of the error"),)
    states = (State("integral", -50.0, 50.0, "W"),)
    outputs = (Output("heat", "W", tolerance=0.01),)

    def step(self, x, u, p):
        """Drive between 0 and 50 W."""
        integral = x.integral + p.ki * u.error  # FAULT
        return {"integral": integral}, {"heat": ops.clip(integral + u.error, 0.0, 40.0)}


class LongVector(Estimator):
    """A length in metres of what comes in millimetres: most of the word is never used."""

    inputs = tuple(Input(n, -1e4, 1e4, "m") for n in "xy")
    outputs = (Output("bearing", "ht", tolerance=1e-4),)

    def step(self, x, u, p):
        """Bearing of a point."""
        return {}, {"bearing": ops.atan2_ht(u.y, u.x)}  # FAULT


class Runaway(Estimator):
    """A filter whose poles lie outside the unit circle."""

    inputs = (Input("x", -1.0, 1.0, "V"),)
    states = (State("y1", -8.0, 8.0, "V"), State("y2", -8.0, 8.0, "V"))
    outputs = (Output("y", "V", tolerance=1e-3),)

    def step(self, x, u, p):
        """The sign of a coefficient is wrong."""
        y = 0.01 * u.x + 1.9 * x.y1 - 0.89 * x.y2  # FAULT
        return {"y1": y, "y2": x.y1}, {"y": y}
