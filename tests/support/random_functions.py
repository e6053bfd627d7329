"""Random expressions of all operations, with a bound of the fixed-point error at every point.

Each value is held as float64 with a bound: what its arguments' errors become in it, and what its
own format adds. Where a decision may go either way within the errors the bound is infinite: there
the words may be anything.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model import ops
from boresight.model.lowering.graph import Intervals
from boresight.model.lowering.lower import lower
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic, Format
from boresight.model.words.program import Program

FloatArray = npt.NDArray[np.float64]

RANGES = ((-1.0, 1.0), (-3.0, 2.0), (-2.0, -0.5), (0.25, 5.0), (-0.05, 0.02), (-40.0, 35.0))
#: Last bits of a value that rounding, a split group or a table adds, in its own format.
_OWN_LSB = 2.0
#: What a table adds, of its full scale: 2^(this - W), and never less than its own cubic.
_TABLE_BITS, _TABLE = 4, 4e-9
#: Share of a range up to which an error is followed.
_SMALL = 1e-2


@dataclass
class Known:
    """A recorded value, its float64 points, the bound of their errors, and its known interval."""

    node: Any
    value: FloatArray
    error: FloatArray
    range: tuple[float, float]


class _Maker:
    """Makes values of values, in one tracer and word length."""

    def __init__(self, word: int, rng: random.Random, tracer: Tracer) -> None:
        self.word, self.rng, self.interval = word, rng, Intervals(tracer)
        self.table = max(2.0 ** (_TABLE_BITS - word), _TABLE)

    def new(self, function: Callable[..., Any], error: Any, *args: Known) -> Known:
        node = function(*(a.node for a in args))
        value = np.asarray(function(*(a.value for a in args)), dtype=np.float64)
        if not isinstance(node, type(args[0].node)):  # folded: a number
            node, value = args[0].node * 0.0 + node, value + 0.0 * args[0].value
            return Known(node, value, 0.0 * value, self.interval(node))
        made = Known(node, value, np.broadcast_to(error, value.shape), self.interval(node))
        low, high = made.range
        slack = 1e-9 * (1.0 + max(abs(low), abs(high)))
        assert low - slack <= value.min() and value.max() <= high + slack, "beyond its interval"
        own = _OWN_LSB * Format.for_range(self.word, low, high).lsb
        # The rules for the errors are of first order.
        small = made.error <= _SMALL * max(map(abs, made.range))
        made.error = np.where(small, made.error + own, np.inf)
        return made

    def linear(self, a: Known) -> Known:
        c = self.rng.choice((0.3, -7.0, 0.5, -0.125, 1.0 / 3.0))
        shift = self.rng.choice((0.0, 1.0, -2.5, 0.1))
        size = max(map(abs, a.range)) * abs(c) + abs(shift)
        error = a.error * abs(c) + size * 2.0**-self.word
        return self.new(lambda x: x * c + shift, error, a)

    def sign(self, a: Known) -> Known:
        return self.new(self.rng.choice((lambda x: -x, ops.absolute)), a.error, a)

    def limited(self, a: Known) -> Known:
        low, high = self.rng.choice(((-0.75, 1.5), (0.0, 0.3), (-9.0, -0.5), (-0.1, 30.0)))
        if self.rng.random() < 0.3:
            return self.new(lambda x: ops.saturated(x, 0.5), a.error, a)
        return self.new(lambda x: ops.clip(x, low, high), a.error, a)

    def turned(self, a: Known) -> Known:
        edge = np.abs((a.value % 2.0) - 1.0) <= 2.0 * a.error
        return self.new(ops.wrap_ht, np.where(edge, np.inf, a.error), a)

    def angle(self, a: Known) -> Known:
        k = self.rng.randrange(2)
        return self.new(lambda x: ops.sincos_ht(x)[k], np.pi * a.error + self.table, a)

    def arc(self, a: Known) -> Known:
        inside = self.new(lambda x: ops.clip(x, 0.0, 0.7), a.error, a)
        return self.new(ops.asin_ht, 0.5 * inside.error + self.table, inside)

    def root(self, a: Known) -> Known:
        """Of a square and something: far from where the root has a floor."""
        low = self.rng.choice((0.25, 1.5))
        square = self.new(lambda x: x * x + low, self.product_error(a, a), a)
        slope = square.error / (2.0 * np.sqrt(square.value)) * 1.1
        slope = np.where(square.error > 0.1 * square.value, np.inf, slope)
        return self.new(ops.sqrt, slope + self.table * np.sqrt(square.value), square)

    def product_error(self, a: Known, b: Known) -> FloatArray:
        return np.asarray(np.abs(a.value) * b.error + np.abs(b.value) * a.error + a.error * b.error)

    def product(self, a: Known, b: Known) -> Known:
        return self.new(lambda x, y: x * y, self.product_error(a, b), a, b)

    def summed(self, a: Known, b: Known) -> Known:
        sign = self.rng.choice((-1, 1))
        add = (lambda x, y: x + y) if sign > 0 else (lambda x, y: x - y)
        return self.new(add, a.error + b.error, a, b)

    def extreme(self, a: Known, b: Known) -> Known:
        function = self.rng.choice((ops.minimum, ops.maximum))
        return self.new(function, np.maximum(a.error, b.error), a, b)

    def ratio(self, a: Known, b: Known) -> Known:
        """By a divisor of either sign that stays away from zero."""
        low, high = self.rng.choice(((0.5, 9.0), (-6.0, -0.25)))
        d = self.new(lambda x: ops.clip(x, low, high), b.error, b)
        size = np.abs(d.value)
        error = (a.error + np.abs(a.value / d.value) * d.error * 1.1) / size
        error = np.where(d.error > 0.1 * size, np.inf, error + self.table * np.abs(a.value) / size)
        return self.new(lambda x, y: x / y, error, a, d)

    def direction(self, a: Known, b: Known) -> Known:
        """Far from the origin and from the cut; the arc sine's table near an eighth is steep."""
        radius = np.hypot(a.value, b.value)
        angle = np.arctan2(a.value, b.value) / np.pi
        error = (a.error + b.error) / np.maximum(radius, 1e-300)
        scale = max(map(abs, (*a.range, *b.range)))
        bad = (radius < 0.05 * scale) | (np.abs(np.abs(angle) - 1.0) < error + 8.0 * self.table)
        return self.new(
            ops.atan2_ht, np.where(bad, np.inf, error + 8.0 * self.table * scale / radius), a, b
        )

    def chosen(self, a: Known, b: Known) -> Known:
        """By one or two comparisons."""
        limit = self.rng.choice((0.0, 0.3, -1.0))
        doubt = np.abs(a.value - b.value) <= 1.01 * (a.error + b.error) + 2.0 ** (4 - self.word)
        error = np.maximum(a.error, b.error)
        kind = self.rng.randrange(3)
        if kind == 0:
            function = lambda x, y: ops.where(x < y, x, 0.5 * y)  # noqa: E731
        elif kind == 1:
            function = lambda x, y: ops.flip(x > y, y)  # noqa: E731
        else:
            doubt |= np.abs(b.value - limit) <= 1.01 * b.error + 2.0 ** (4 - self.word)
            both = self.rng.random() < 0.5
            function = lambda x, y: ops.where(  # noqa: E731
                (x < y) & ~(y < limit) if both else (x >= y) | (y > limit), y, x
            )
        return self.new(function, np.where(doubt, np.inf, error), a, b)


_ONE = ("linear", "sign", "limited", "turned", "angle", "arc", "root")
_TWO = ("product", "product", "summed", "extreme", "ratio", "direction", "chosen")


def _expression(make: _Maker, leaves: list[Known], depth: int) -> Known:
    rng = make.rng
    if depth == 0 or rng.random() < 0.1:
        return rng.choice(leaves)
    a = _expression(make, leaves, depth - 1)
    if max(map(abs, a.range)) > 1e4:  # further products would leave the word
        return make.new(lambda x: ops.clip(x, -2.0, 2.0), a.error, a)
    one: Callable[[Known], Known] = getattr(make, rng.choice(_ONE))
    two: Callable[[Known, Known], Known] = getattr(make, rng.choice(_TWO))
    return one(a) if rng.random() < 0.5 else two(a, _expression(make, leaves, depth - 1))


@cache
def random_functions(
    seed: int, word: int, *, count: int = 3, depth: int = 4, points: int = 160
) -> tuple[Program, Any, list[Known]]:
    """A program of random expressions, its input words (inputs, points), and what is wanted."""
    rng, draw = random.Random(seed), np.random.default_rng(seed)
    g = Tracer("random")
    formats = [Format.for_range(word, *r) for r in RANGES]
    words = np.stack([f.quantise(draw.uniform(*r, points)) for f, r in zip(formats, RANGES)])  # noqa: B905
    leaves = [g.leaf("input", f"x{k}", *r) for k, r in enumerate(RANGES)]
    known = [
        Known(leaf, f.real(w), np.zeros(points), r)
        for leaf, f, w, r in zip(leaves, formats, words, RANGES, strict=True)
    ]
    make = _Maker(word, rng, g)
    with np.errstate(all="ignore"):  # what is not known of an argument is not known of the value
        results = [_expression(make, known, depth) for _ in range(count)]
    outputs = {f"y{k}": r.node for k, r in enumerate(results)}
    return lower(Trace(g, leaves, outputs), Arithmetic(word=word))[0], words, results
