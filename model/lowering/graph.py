"""From the record of a ``step`` to nodes, each with the interval of its values.

Functions become sums, products, selections and what the tables hold (sine, arc sine, inverse root,
reciprocal). Exponential and logarithm need no table: their argument is brought to one binade, where
a polynomial will do, and back.

What intervals or constants decide disappears. A node whose interval cannot be known must be bounded
by its author (`model.ops.bounded`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.profile import Range
from boresight.model.lowering.trace import Expression, Scalar, Tracer, finite
from boresight.model.words import rounded
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Program

#: Kinds of nodes that have no arguments.
LEAVES = ("input", "param", "state", "const")
#: Kinds of nodes in words.
_KINDS = {
    "sum": "this sum",
    "mul": "this product",
    "select": "this selection",
    "abs": "this magnitude",
    "reciprocal": "this quotient",
    "rsqrt": "this inverse root",
    "const": "this constant",
}
#: Largest over least word, without sign, in the shortest words.
_BELOW = 1.0 - 2.0**-17
#: Ratio of the limits from which a divisor needs an upper limit too, for its word.
_SPAN = 2.0**16
#: How far a number may be moved to be limited, in halves of the range between the limits: what one
#: accumulator holds. Farther ones are first limited by a word.
_FAR = 2.0**16


@dataclass(eq=False)
class Node:
    """One value.

    ``signs`` belongs to kind "sum"; ``value`` to "const", "saturated" and "wrap" (the period);
    ``quarter`` to "sin" (cosine). ``line`` is where its author wrote it: "file.py, line 41".
    ``title`` is the name of the output or the next state that it is. ``fit`` is a range for its
    format alone (`model.lowering.profile`); what the interval decides, it does not. ``reason``
    says why a "bounded" one stays in its range, and ``unless`` when it does not.
    """

    number: int
    kind: str
    args: tuple[Node, ...] = field(default=(), repr=False)
    signs: tuple[int, ...] = ()
    value: float = 0.0
    quarter: bool = False
    low: float = -math.inf
    high: float = math.inf
    source: str = "interval"
    unit: str = ""
    name: str | None = None
    uses: int = 0
    line: str = ""
    title: str = ""
    fit: tuple[float, float] | None = None
    unless: str = ""
    reason: str = ""

    @property
    def span(self) -> tuple[float, float]:
        """The range that its format is chosen for: ``fit``, or its interval."""
        return self.fit or (self.low, self.high)

    @property
    def label(self) -> str:
        return self.name or self.title or f"{self.kind}_{self.number}"

    @property
    def description(self) -> str:
        """Description for its author: the name, or the kind of expression."""
        return self.name or self.title or _KINDS.get(self.kind, self.kind)

    @property
    def range(self) -> str:
        return f"[{self.low:g}, {self.high:g}]"


def declared_name(program: Program, nodes: Mapping[int, Node], value: int) -> str:
    """Name of a value; of a state that shares it with an input or parameter, without a suffix."""
    node = nodes.get(value)
    return (node is not None and node.kind in LEAVES and node.name) or program.values[value].name


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


@dataclass(frozen=True, eq=False)
class Flag:
    """True where ``node`` is negative (or, inverted, where it is not)."""

    node: Node
    inverted: bool = False


def expand(
    tracer: Tracer, limits: Mapping[int, Range] | None = None, arithmetic: Arithmetic = _WIDEST
) -> tuple[Graph, list[Any]]:
    """The graph of a record, and the node (or flag) of each of its expressions.

    ``limits``: divisions and roots, by number, whose last argument is held in such a range
    (`Graph.limited`). InputError: an argument's range exceeds what its function takes.
    """
    graph, made = Graph(tracer.name, arithmetic), list[Any]()
    _extend(graph, made, tracer.expressions, limits or {})
    return graph, made


def _extend(
    graph: Graph, made: list[Any], expressions: Sequence[Expression], limits: Mapping[int, Range]
) -> None:
    """Add nodes (or flags) of further expressions to those ``made``."""
    for e in expressions:
        graph.line = e.line
        args = [made[a.number] for a in e.args]
        if e.number in limits:
            args[-1] = graph.limited(args[-1], *limits[e.number])
        made.append(getattr(graph, e.kind)(*args, *e.data))


class Intervals:
    """Intervals of recorded expressions, while the tracer still records."""

    def __init__(self, tracer: Tracer) -> None:
        self._tracer = tracer
        self._graph = Graph(tracer.name)
        self._nodes: list[Any] = []

    def __call__(self, x: Any) -> tuple[float, float]:
        """Least and largest value of a recorded value or number."""
        if not isinstance(x, Scalar):
            return float(x), float(x)
        new = self._tracer.expressions[len(self._nodes) : x.number + 1]
        _extend(self._graph, self._nodes, new, {})
        node = self._nodes[x.number]
        return node.low, node.high

    def size(self, x: Any) -> float:
        """Largest magnitude."""
        low, high = self(x)
        return max(abs(low), abs(high))


class Graph:
    """Builds nodes, one per distinct expression: a method for each kind of `model.ops`.

    ``line`` is the author's, for new ones.
    """

    def __init__(self, name: str, arithmetic: Arithmetic = _WIDEST) -> None:
        self.name = name
        self.arithmetic = arithmetic
        self.line = ""
        self.nodes: list[Node] = []
        self._unique: dict[Any, Node] = {}

    def _new(self, kind: str, *args: Node, key: Any = None, **attributes: Any) -> Node:
        key = (kind, *(a.number for a in args), key)
        if key not in self._unique:
            self._unique[key] = Node(len(self.nodes), kind, args, line=self.line, **attributes)
            self.nodes.append(self._unique[key])
        return self._unique[key]

    def leaf(self, kind: str, name: str, low: float, high: float, unit: str) -> Node:
        declared = {"name": name, "low": low, "high": high, "unit": unit}
        return self._new(kind, key=name, source="declared", **declared)

    def const(self, value: float) -> Node:
        value = finite(value, lambda: self.line or self.name)
        return self._new("const", key=value, value=value, low=value, high=value, source="constant")

    def outside(self, a: Node, wanted: str, fix: str) -> InputError:
        """Error: the range of an argument is not one that the function accepts."""
        at = f" of {a.line}" if a.line and a.line != self.line and not a.name else ""
        found = f"{a.description}{at} in {a.range}"
        return InputError.at(self.line or self.name, wanted=wanted, found=found, fix=fix)

    def named(self, a: Node, name: str) -> Node:
        """``a``; the first name that it gets stays."""
        if a.kind not in LEAVES and a.name is None:
            a.name = name
        return a

    def same(self, a: Node, tag: str) -> Node:
        """``a``; the two differ only in the record."""
        return a

    # -- arithmetic -----------------------------------------------------------------------------

    def add(self, a: Node, b: Node) -> Node:
        return self._sum(a, 1, b, 1)

    def sub(self, a: Node, b: Node) -> Node:
        return self._sum(a, 1, b, -1)

    def neg(self, a: Node) -> Node:
        return self._sum(self.const(0.0), 1, a, -1)

    def _sum(self, a: Node, sign_a: int, b: Node, sign_b: int) -> Node:
        if a.kind == b.kind == "const":
            return self.const(sign_a * a.value + sign_b * b.value)
        if a is b:
            return self.mul(a, self.const(sign_a + sign_b))
        terms = [(n, s) for n, s in ((a, sign_a), (b, sign_b)) if n.kind != "const" or n.value]
        if len(terms) == 1:
            node, sign = terms[0]
            if sign == 1:
                return node
            if node.kind == "sum" and node.signs == (-1,) and node.name is None:
                return node.args[0]
        nodes, signs = zip(*terms, strict=True)
        low = rounded.sum_of(n.low if s > 0 else -n.high for n, s in terms)
        high = rounded.sum_of(n.high if s > 0 else -n.low for n, s in terms)
        return self._new("sum", *nodes, key=signs, signs=signs, low=low, high=high)

    def mul(self, a: Node, b: Node) -> Node:
        """a * b; constants come second."""
        if a.kind == "const":
            a, b = b, a
        if a.kind == "const":
            return self.const(a.value * b.value)
        if b.kind == "const":
            if b.value == 0.0:
                return b
            if b.value == 1.0:
                return a
            if b.value == -1.0:
                return self.neg(a)
            if a.kind == "mul" and a.args[1].kind == "const" and a.name is None:
                return self.mul(a.args[0], self.const(a.args[1].value * b.value))
        elif a.number > b.number:
            a, b = b, a
        if a is b:
            edges = sorted((a.low * a.low, a.high * a.high))
            low = 0.0 if a.low <= 0.0 <= a.high else edges[0]
            return self._new("mul", a, b, low=low, high=edges[1])
        if b.kind == "rsqrt" and b.args[0] is a:  # the root
            low, high = (math.sqrt(max(edge, 0.0)) for edge in (a.low, a.high))
            return self._new("mul", a, b, low=low, high=high)
        corners = [x * y if x and y else 0.0 for x in (a.low, a.high) for y in (b.low, b.high)]
        return self._new("mul", a, b, low=min(corners), high=max(corners))

    def div(self, a: Node, b: Node) -> Node:
        if b.low <= 0.0 <= b.high:
            floor = "ops.maximum(x, SMALLEST) or " * (max(-b.low, b.high) < _SPAN)
            fix = f"divide by {floor}ops.clip(x, SMALLEST, LARGEST)"
            if b.low < 0.0 < b.high:
                fix += "; x of either sign: limit ops.absolute(x), and ops.flip(x < 0.0, quotient)"
                fix += "; a quotient that has a value at x = 0, as sin(x) / x: its series"
            raise self.outside(b, "a divisor whose range excludes 0", fix)
        if b.kind == "const":
            return self.mul(a, self.const(1.0 / b.value))
        return self.mul(a, self._new("reciprocal", b, low=1.0 / b.high, high=1.0 / b.low))

    # -- conditions -----------------------------------------------------------------------------

    def less(self, a: Node, b: Node) -> Flag:
        return Flag(self.sub(a, b))

    def invert(self, flag: Flag) -> Flag:
        return Flag(flag.node, not flag.inverted)

    def both(self, a: Flag, b: Flag) -> Flag:
        """One selection: where a holds, b's node decides; elsewhere a constant that fails."""
        # The constant must survive the binary point of b's node: take its magnitude.
        bound = max(-b.node.low, b.node.high) or 1.0
        fails = self.const(-bound if b.inverted else 0.0)
        return Flag(self.select(a, b.node, fails), b.inverted)

    def either(self, a: Flag, b: Flag) -> Flag:
        """As the opposite of both opposites."""
        return self.invert(self.both(self.invert(a), self.invert(b)))

    def differs(self, a: Flag, b: Flag) -> Flag:
        """-1 where b holds, else 1; where a holds, with the other sign."""
        sign = self.select(b, self.const(-1.0), self.const(1.0))
        return Flag(self.flip(Flag(a.node), sign), a.inverted)

    def select(
        self, condition: Flag, yes: Node, no: Node, low: float = -math.inf, high: float = math.inf
    ) -> Node:
        """``yes`` where the condition holds, else ``no``; both together in [low, high]."""
        if condition.inverted:
            yes, no = no, yes
        c = condition.node
        if c.high < 0.0 or yes is no:
            return yes
        if c.low >= 0.0:
            return no
        low, high = max(low, min(yes.low, no.low)), min(high, max(yes.high, no.high))
        return self._new("select", c, yes, no, low=low, high=high)

    def flip(self, condition: Flag, a: Node) -> Node:
        """-a where the condition holds, else a."""
        c = condition.node
        if c.high < 0.0 or c.low >= 0.0:
            return self.neg(a) if (c.high < 0.0) != condition.inverted else a
        if condition.inverted:
            return self.neg(self.flip(self.invert(condition), a))
        bound = max(abs(a.low), abs(a.high))
        return self._new("flip", c, a, low=-bound, high=bound)

    # -- limits ---------------------------------------------------------------------------------

    def absolute(self, a: Node) -> Node:
        if a.low >= 0.0:
            return a
        if a.high <= 0.0:
            return self.neg(a)
        return self._new("abs", a, low=0.0, high=max(-a.low, a.high))

    def larger(self, a: Node, b: Node) -> Node:
        return self.select(self.less(a, b), b, a, low=max(a.low, b.low))

    def smaller(self, a: Node, b: Node) -> Node:
        return self.select(self.less(a, b), a, b, high=min(a.high, b.high))

    def wrap(self, a: Node, period: float = 2.0, unit: str = "ht") -> Node:
        """``a`` modulo a period, about 0: the word's own overflow."""
        half = 0.5 * period
        if a.kind == "const":
            return self.const((a.value + half) % period - half)
        limits = {"low": -half, "high": half, "unit": unit, "value": period}
        limits["source"] = "half turns" if unit == "ht" else "turns"
        return self._new("wrap", a, key=period, **limits)

    def wrap_turns(self, a: Node) -> Node:
        return self.wrap(a, 1.0, "turn")

    def bounded(self, a: Node, low: float, high: float, reason: str, unless: str = "") -> Node:
        """``a`` in [low, high], as declared; a word outside saturates."""
        if a.kind == "const" and low <= a.value <= high:
            return a
        said = {"source": f"declared: {reason}", "reason": reason, "unless": unless}
        return self._new("bounded", a, key=(low, high), unit=a.unit, low=low, high=high, **said)

    def limited(self, a: Node, low: float, high: float) -> Node:
        """``a`` of one sign, held off zero by comparison: at least ``low``, or at most ``high``.

        A value without a finite range is clamped by the word's own overflow, at a power of two; one
        that spans more than a divisor's word is bounded, which raises the saturation flag.
        """
        near, far = sorted((abs(low), abs(high)))
        limit, size = math.ldexp(2.0, rounded.binary_exponent(far)), max(-a.low, a.high)
        if not math.isfinite(a.low + a.high):
            a = self.saturated(a, limit)
        elif near > 0.0 and size > max(_SPAN * near, limit):
            smallest, largest = max(a.low, -limit), min(a.high, limit)
            a = self.bounded(a, smallest, largest, "as far as runs came, and more")
        return self.larger(a, self.const(low)) if low >= 0.0 else self.smaller(a, self.const(high))

    def saturated(self, a: Node, limit: float) -> Node:
        """``a`` clamped to [-limit, limit), a power of two, by the word's own overflow."""
        if -limit <= a.low and a.high < limit:
            return a
        low, high = (min(max(edge, -limit), limit) for edge in (a.low, a.high))
        if low == high:
            return self.const(low)
        limits = {"low": low, "high": high, "source": "saturated on purpose"}
        return self._new("saturated", a, key=limit, value=limit, unit=a.unit, **limits)

    def clip(self, a: Node, low: float, high: float) -> Node:
        """``a`` limited to [low, high]: moved so that a limit is the least word, and back.

        With 2^k above half of the range::

            y = saturated(a - low - 2^k)        z = saturated(high - 2^k - (y + low + 2^k))

        and the result is high - 2^k - z, exact at the limits and between, as far as words are.
        """
        below, above = a.low < low, a.high > high
        smallest, largest = max(a.low, low), min(a.high, high)
        if not (below or above):
            return a
        if smallest >= largest:
            return self.const(low if below else high)
        size, span = max(abs(smallest), abs(largest)), (largest - smallest) / _BELOW
        half = math.ldexp(1.0, rounded.binary_exponent(span)) if math.isfinite(span) else 0.0
        if _FAR * half < max(-a.low, a.high) < math.inf > size:
            a = self.saturated(a, math.ldexp(2.0, rounded.binary_exponent(size)))
        if size > _FAR * half:  # moved so far, a word would lose its last bits
            a = self.larger(a, self.const(low)) if below else a
            a = self.smaller(a, self.const(high)) if above else a
            return self.bounded(a, smallest, largest, "clip")
        lower, upper = self.const(smallest + half), self.const(largest - half)
        if below:
            a = self.add(self.saturated(self.sub(a, lower), half), lower)
        if above:
            a = self.sub(upper, self.saturated(self.sub(upper, a), half))
        limits = {"low": smallest, "high": largest, "unit": a.unit}
        if not below and math.frexp(smallest)[0] == -0.5 and largest < -smallest:
            # Rounding alone passes the least word.
            limits |= {"source": "saturated on purpose", "value": -smallest}
            return self._new("saturated", a, key=-smallest, **limits)
        return self.bounded(a, smallest, largest, "clip")

    # -- functions ------------------------------------------------------------------------------

    def sin(self, a: Node, quarter: bool = False) -> Node:
        """sin(pi a), or with ``quarter`` the cosine, of any number of half turns."""
        if a.kind == "const":
            return self.const(ops.sincos_ht(a.value)[quarter])
        circle = a.high == 1.0 and a.unit == "ht"  # its word of 1 is that of -1
        if a.low < -1.0 or (a.high >= 1.0 and not circle):
            a = self.wrap(a)
        return self._new("sin", a, key=quarter, quarter=quarter, low=-1.0, high=1.0)

    def cos(self, a: Node) -> Node:
        return self.sin(a, quarter=True)

    def asin(self, a: Node) -> Node:
        """Half turns whose sine is ``a`` in [0, `ASIN_LIMIT`]."""
        if a.kind == "const":
            return self.const(ops.asin_ht(a.value))
        if (a.low < 0.0 or a.high > ASIN_LIMIT) and a.kind != "saturated":  # that is on purpose
            fix = "limit it with ops.clip, or use boresight.model.algebra.angles.asin_ht"
            raise self.outside(a, f"an argument of ops.asin_ht in [0, {ASIN_LIMIT}]", fix)
        return self._new("asin", a, low=0.0, high=0.26, unit="ht")

    def rsqrt(self, a: Node) -> Node:
        if a.kind == "const" and a.value > 0.0:
            return self.const(ops.rsqrt(a.value))
        if a.low < 0.0:
            fix = "take it of ops.maximum(x, 0.0), or say ops.bounded"
            raise self.outside(a, "a root of 0 or more", fix)
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
                smallest = min(x, y, key=lambda a: max(-a.low, a.high))
                wanted = f"components of ops.atan2_ht whose ranges differ by at most 2^{furthest}"
                raise self.outside(smallest, wanted, "limit the larger one with ops.clip")
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
        return self.wrap(self.add(base, self.flip(self.less(sign, zero), self.asin(sine))))

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
        g = self.wrap_turns(self.add(turns, self.const(0.5)))
        above = self.add(self.sub(g, turns), self.const(float(k)))  # m + 1/2
        y = self.saturated(self._polynomial(g, rounded.exp2()), 1.0)
        for j in range(math.floor(span).bit_length()):
            odd = self.wrap(self._scaled(above, 2.0**-j))
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
            wanted = f"the argument of a logarithm above 0, over at most 2^{_BINADES}"
            fix = "take it of ops.maximum(x, SMALLEST) or ops.clip(x, SMALLEST, LARGEST)"
            raise self.outside(a, wanted, fix)
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
