"""From the record of a ``step`` to nodes: `expand` takes it expression by expression.

Functions become sums, products, selections and what the tables hold (sine, arc sine, inverse root,
reciprocal). Exponential and logarithm need no table: their argument is brought to one binade, where
a polynomial will do, and back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from boresight.model import ops
from boresight.model.lowering.graph import Graph, Node
from boresight.model.lowering.profile import Range
from boresight.model.lowering.trace import Tracer
from boresight.model.words import rounded
from boresight.model.words.fixed import Arithmetic

#: Largest sine that the table of the arc sine holds, a little above sqrt(1/2).
ASIN_LIMIT = 0.7188
#: Largest argument of the exponential; 2^64 is a little more.
EXP_LIMIT = 44.0
#: Binades that an exponential has, and most that the argument of a logarithm may span.
_BINADES = 31
#: By how much rounding may take a result beyond its interval, as a share of its size.
_SLACK = 2e-8
#: Largest over least squared length up to which the inverse root of a sum of squares is exact.
_LENGTHS = 32.0
#: When a result leaves the range that follows from its argument's.
_ARGUMENT = "its argument leaves its range"
#: Words whose functions take the widest ranges.
_WIDEST = Arithmetic()


def expand(
    tracer: Tracer, limits: Mapping[int, Range] | None = None, arithmetic: Arithmetic = _WIDEST
) -> tuple[Expansion, list[Any]]:
    """The graph of a record, and the node (or flag) of each of its expressions.

    Parameters
    ----------
    tracer : Tracer
    limits : mapping of int to (float, float), optional
        Divisions and roots, by number, whose last argument is held in such a range
        (`Graph.limited`).
    arithmetic : Arithmetic
        That of the words; by default of 32 bits.

    Raises
    ------
    InputError
        An argument's range exceeds what its function takes; the message gives the author's line.
    """
    graph, made, limits = Expansion(tracer.name, arithmetic), list[Any](), limits or {}
    for e in tracer.expressions:
        graph.line = e.line
        args = [made[a.number] for a in e.args]
        if e.number in limits:
            args[-1] = graph.limited(args[-1], *limits[e.number])
        made.append(getattr(graph, e.kind)(*args, *e.data))
    return graph, made


class Expansion(Graph):
    """A graph that knows the functions of `model.ops`: a method for each kind of expression."""

    def __init__(self, name: str, arithmetic: Arithmetic = _WIDEST) -> None:
        super().__init__(name)
        self.arithmetic = arithmetic

    def sin(self, a: Node, quarter: bool = False) -> Node:
        """sin(pi a), or with ``quarter`` the cosine, of any number of half turns."""
        if a.kind == "const":
            return self.const(ops.sincos_ht(a.value)[quarter])
        circle = a.high == 1.0 and a.unit == "ht"  # its word of 1 is that of -1
        if a.low < -1.0 or (a.high >= 1.0 and not circle):
            a = self.wrap(a)
        return self._new("sin", a, key=quarter, quarter=quarter, low=-1.0, high=1.0)

    def cos(self, a: Node) -> Node:
        """cos(pi a)."""
        return self.sin(a, quarter=True)

    def asin(self, a: Node) -> Node:
        """Half turns whose sine is ``a`` in [0, `ASIN_LIMIT`]."""
        if a.kind == "const":
            return self.const(ops.asin_ht(a.value))
        if (a.low < 0.0 or a.high > ASIN_LIMIT) and a.kind != "saturated":  # that is on purpose
            raise self.outside(
                a,
                f"an argument of ops.asin_ht in [0, {ASIN_LIMIT}]",
                "limit it with ops.clip, or use boresight.model.algebra.angles.asin_ht",
            )
        return self._new("asin", a, low=0.0, high=0.26, unit="ht")

    def rsqrt(self, a: Node) -> Node:
        """1 / sqrt(a)."""
        if a.kind == "const" and a.value > 0.0:
            return self.const(ops.rsqrt(a.value))
        if a.low < 0.0:
            raise self.outside(
                a, "a root of 0 or more", "take it of ops.maximum(x, 0.0), or say ops.bounded"
            )
        low = 1.0 / math.sqrt(a.high) if a.high else 0.0
        high = 1.0 / math.sqrt(a.low) if a.low else math.inf
        return self._new("rsqrt", a, low=low, high=high)

    def sqrt(self, a: Node) -> Node:
        """sqrt(a), as a / sqrt(a)."""
        if a.kind == "const" and a.value >= 0.0:
            return self.const(ops.sqrt(a.value))
        return self.mul(a, self.rsqrt(a))

    def atan2(self, y: Node, x: Node) -> Node:
        """Angle of the vector (x, y) in half turns, [-1, 1).

        A vector that may be short is first multiplied by the power of two that brings its larger
        component into [1/2, 1), so that its squares keep their bits; twice where the components
        have ranges of unequal sizes, since one word of both is then too coarse for the smaller.

        The smaller component becomes a sine, s = min(|x|, |y|) / sqrt(x^2 + y^2), whose arc sine
        the table holds; then the octants are unfolded::

            swap = |x| < |y|                             the angle is measured from the y axis
            angle = base +- asin(s),  minus if swap xor (x < 0) xor (y < 0)
            base  = swap ? (y < 0 ? -1/2 : 1/2) : (x < 0 ? 1 : 0)
        """
        zero = self.const(0.0)
        xx, yy = self.mul(x, x), self.mul(y, y)
        swap, squares = self.less(xx, yy), self.add(xx, yy)
        if squares.kind != "const" and not squares.high <= _LENGTHS * squares.low:
            sizes = {rounded.binary_exponent(max(-a.low, a.high)) for a in (x, y)}
            furthest = self.arithmetic.norm_max  # a short vector needs as many bits in one word
            if max(sizes) - min(sizes) > furthest and "const" not in (x.kind, y.kind):
                raise self.outside(
                    min(x, y, key=lambda a: max(-a.low, a.high)),
                    f"components of ops.atan2_ht whose ranges differ by at most 2^{furthest}",
                    "limit the larger one with ops.clip",
                )
            for _ in sizes:
                swap = self.less(self.absolute(x), self.absolute(y))
                larger = self.larger(self.absolute(x), self.absolute(y))
                x, y = self._normalised(x, larger), self._normalised(y, larger)
            squares = self.add(self.mul(x, x), self.mul(y, y))
        smaller = self.absolute(self.select(swap, x, y))
        sine = self.mul(smaller, self.rsqrt(squares))
        sine = self.bounded(sine, 0.0, ASIN_LIMIT, "smaller component of a unit vector")
        sign = self.flip(swap, self.flip(self.less(x, zero), y))
        up = self.flip(self.less(y, zero), self.const(0.5))
        base = self.select(swap, up, self.select(self.less(x, zero), self.const(-1.0), zero))
        base = self.bounded(base, -1.0, 0.5, "quadrant")  # known early: a group of its own
        turned = self.flip(self.less(sign, zero), self.asin(sine))
        return self.wrap(self.add(base, turned))

    def _normalised(self, a: Node, size: Node) -> Node:
        """``a`` times the power of two that brings ``size``, at least |a|, into [1/2, 1)."""
        if a.kind == "const" and a.value == 0.0:
            return a
        limits = {"low": -1.0 if a.low < 0.0 else 0.0, "high": 1.0 if a.high > 0.0 else 0.0}
        return self._new("normalised", a, size, **limits)

    # -- exponential and logarithm --------------------------------------------------------------

    def _scaled(self, a: Node, factor: float) -> Node:
        return self.mul(a, self.const(factor))

    def _polynomial(self, x: Node, c: tuple[float, ...]) -> Node:
        """c0 + c1 x + x^2 (c2 + c3 x + x^2 (...)), of an even number of coefficients."""
        square = self.mul(x, x)
        total = self.const(0.0)
        for k in reversed(range(0, len(c), 2)):
            pair = self.add(self.const(c[k]), self._scaled(x, c[k + 1]))
            total = self.add(pair, self.mul(square, total))
        return total

    def exp(self, a: Node) -> Node:
        """e^a, of a up to `EXP_LIMIT`; what is 2^31 times below the largest counts as that.

        With z = a log2(e) - k < 0, e^a = 2^k 2^-m 2^(g - 1/2) of a whole number m >= 0 and g in
        [-1/2, 1/2), the part of z + 1/2 that no whole number takes::

            g = wrap(z + 1/2)        m = g - 1/2 - z        bit j of m: wrap((m + 1/2) 2^-j) < 0

        With the half, no rounding decides a bit.
        """
        if a.kind == "const":
            return self.const(ops.exp(a.value))
        if not (a.high <= EXP_LIMIT and a.low > -math.inf):
            raise self.outside(a, f"an exponent of at most {EXP_LIMIT:g}", "limit it with ops.clip")
        k = math.floor(a.high * rounded.LOG2_E) + 1
        least = (k - _BINADES) * rounded.LN_2
        span = min(k - a.low * rounded.LOG2_E, _BINADES)
        x = self.larger(a, self.const(least)) if a.low < least else a
        turns = self._scaled(x, rounded.LOG2_E)
        g = self._wrap(self.add(turns, self.const(0.5)), 1.0, "turn")
        above = self.add(self.sub(g, turns), self.const(float(k)))  # m + 1/2
        y = self.saturated(self._polynomial(g, rounded.exp2()), 1.0)
        for j in range(math.floor(span).bit_length()):
            odd = self._wrap(self._scaled(above, 2.0**-j), 2.0, "ht")
            shifted = self._scaled(y, 2.0 ** -(2**j))
            y = self.select(self.less(odd, self.const(0.0)), shifted, y)
        whole = self._scaled(y, math.ldexp(1.0, k))
        return self.bounded(whole, ops.exp(a.low), ops.exp(a.high), "exp", _ARGUMENT)

    def log(self, a: Node) -> Node:
        """Natural logarithm of a > 0.

        a = 2^k 2^-m y of a whole number m >= 0 and y in [1/2, 1), found bit by bit of m::

            log(a) = log(y) + (k - m) log(2)
        """
        if a.kind == "const" and a.value > 0.0:
            return self.const(ops.log(a.value))
        if not math.ldexp(a.high, -_BINADES) <= a.low or a.low <= 0.0:
            raise self.outside(
                a,
                f"the argument of a logarithm above 0, over at most 2^{_BINADES}",
                "take it of ops.maximum(x, SMALLEST) or ops.clip(x, SMALLEST, LARGEST)",
            )
        k = rounded.binary_exponent(a.high) + 1
        y = self.saturated(self._scaled(a, math.ldexp(1.0, -k)), 1.0)
        rest = self.const(k * rounded.LN_2)
        for j in reversed(range(_BINADES.bit_length())):  # those that the range decides vanish
            small = self.less(y, self.const(2.0 ** -(2**j)))
            for step in (8, 8) if j == 4 else (2**j,):  # what a word of 18 bits can be shifted
                y = self.saturated(self.select(small, self._scaled(y, 2.0**step), y), 1.0)
            less = self.select(small, self.const(2**j * rounded.LN_2), self.const(0.0))
            rest = self.sub(rest, less)
        centred = self.saturated(self.sub(self._scaled(y, 4.0), self.const(3.0)), 1.0)
        total = self.add(self._polynomial(centred, rounded.log()), rest)
        low, high = ops.log(a.low), ops.log(a.high)
        slack = _SLACK * max(1.0, abs(low), abs(high))
        return self.bounded(total, low - slack, high + slack, "log", _ARGUMENT)

    def tanh(self, a: Node) -> Node:
        """Hyperbolic tangent: (1 - t) / (1 + t), t = e^(-2 |a|), with the sign of a."""
        if a.kind == "const":
            return self.const(ops.tanh(a.value))
        size = max(abs(a.low), abs(a.high))
        t = self.exp(self._scaled(self.absolute(a), -2.0))
        unit = self.const(1.0)
        y = self.div(self.sub(unit, t), self.add(unit, t))
        y = self.bounded(y, 0.0, ops.tanh(size) * (1.0 + _SLACK), "tanh")
        return self.flip(self.less(a, self.const(0.0)), y)
