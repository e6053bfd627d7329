"""Nodes that lowering knows, each with the interval of its values.

What intervals or constants decide disappears. A node whose interval cannot be known must be bounded
by its author (`model.ops.bounded`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from boresight.model.errors import InputError
from boresight.model.lowering.trace import finite
from boresight.model.words import rounded
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
#: Largest over least word, without sign, in the shortest words: a complement has the format of its
#: argument, and a selection from it keeps its last bit.
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
    format alone (`model.lowering.profile`); what the interval decides, it does not. ``unless``
    says when a "bounded" one leaves its range.
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

    @property
    def span(self) -> tuple[float, float]:
        """The range that its format is chosen for: ``fit``, or its interval."""
        return self.fit or (self.low, self.high)

    @property
    def label(self) -> str:
        """The name, or the kind with the number."""
        return self.name or self.title or f"{self.kind}_{self.number}"

    @property
    def description(self) -> str:
        """Description for its author: the name, or the kind of expression."""
        return self.name or self.title or _KINDS.get(self.kind, self.kind)

    @property
    def range(self) -> str:
        """The interval as a text."""
        return f"[{self.low:g}, {self.high:g}]"


def declared_name(program: Program, nodes: Mapping[int, Node], value: int) -> str:
    """Name of a value; of a state that shares it with an input or parameter, without a suffix."""
    node = nodes.get(value)
    return (node is not None and node.kind in LEAVES and node.name) or program.values[value].name


@dataclass(frozen=True, eq=False)
class Flag:
    """True where ``node`` is negative (or, inverted, where it is not)."""

    node: Node
    inverted: bool = False


class Graph:
    """Builds nodes, one per distinct expression. ``line`` is the author's, for new ones."""

    def __init__(self, name: str) -> None:
        self.name = name
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
        """An input, parameter or state with its declared range."""
        declared = {"name": name, "low": low, "high": high, "unit": unit}
        return self._new(kind, key=name, source="declared", **declared)

    def const(self, value: float) -> Node:
        """A constant."""
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
        """a + b."""
        return self._sum(a, 1, b, 1)

    def sub(self, a: Node, b: Node) -> Node:
        """a - b."""
        return self._sum(a, 1, b, -1)

    def neg(self, a: Node) -> Node:
        """-a."""
        return self._sum(self.const(0.0), 1, a, -1)

    def _sum(self, a: Node, sign_a: int, b: Node, sign_b: int) -> Node:
        if a.kind == b.kind == "const":
            return self.const(sign_a * a.value + sign_b * b.value)
        if a is b:
            return self.mul(a, self.const(sign_a + sign_b))
        terms = [
            (n, s)
            for n, s in ((a, sign_a), (b, sign_b))
            if not (n.kind == "const" and n.value == 0.0)
        ]
        if len(terms) == 1:
            node, sign = terms[0]
            if sign == 1:
                return node
            if node.kind == "sum" and node.signs == (-1,) and node.name is None:
                return node.args[0]
        nodes, signs = zip(*terms, strict=True)
        low = sum(n.low if s > 0 else -n.high for n, s in terms)
        high = sum(n.high if s > 0 else -n.low for n, s in terms)
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
        """a / b."""
        if b.low <= 0.0 <= b.high:
            floor = "ops.maximum(x, SMALLEST) or " * (max(-b.low, b.high) < _SPAN)
            fix = f"divide by {floor}ops.clip(x, SMALLEST, LARGEST)"
            if b.low < 0.0 < b.high:
                fix += "; x of either sign: limit ops.absolute(x), and ops.flip(x < 0.0, quotient)"
            raise self.outside(b, "a divisor whose range excludes 0", fix)
        if b.kind == "const":
            return self.mul(a, self.const(1.0 / b.value))
        return self.mul(a, self._new("reciprocal", b, low=1.0 / b.high, high=1.0 / b.low))

    # -- conditions -----------------------------------------------------------------------------

    def less(self, a: Node, b: Node) -> Flag:
        """a < b."""
        return Flag(self.sub(a, b))

    def invert(self, flag: Flag) -> Flag:
        """Not."""
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
        """One selection: b's node, or where a holds its complement, which has the other sign."""
        inverted = a.inverted != b.inverted
        for this, other in ((a.node, b.node), (b.node, a.node)):
            if this.high < 0.0 or this.low >= 0.0:
                return Flag(other, inverted != (this.high < 0.0))
        if a.node is b.node:
            return Flag(self.const(0.0), inverted)
        low, high = min(b.node.low, -b.node.high), max(b.node.high, -b.node.low * _BELOW)
        return Flag(self._new("complement", a.node, b.node, low=low, high=high), inverted)

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
        certain = True if c.high < 0.0 else False if c.low >= 0.0 else None
        if certain is not None:
            return self.neg(a) if certain != condition.inverted else a
        if condition.inverted:
            return self.neg(self.flip(self.invert(condition), a))
        bound = max(abs(a.low), abs(a.high))
        return self._new("flip", c, a, low=-bound, high=bound)

    # -- limits ---------------------------------------------------------------------------------

    def absolute(self, a: Node) -> Node:
        """|a|."""
        if a.low >= 0.0:
            return a
        if a.high <= 0.0:
            return self.neg(a)
        return self._new("abs", a, low=0.0, high=max(-a.low, a.high))

    def larger(self, a: Node, b: Node) -> Node:
        """max(a, b)."""
        return self.select(self.less(a, b), b, a, low=max(a.low, b.low))

    def smaller(self, a: Node, b: Node) -> Node:
        """min(a, b)."""
        return self.select(self.less(a, b), a, b, high=min(a.high, b.high))

    def wrap(self, a: Node) -> Node:
        """``a`` half turns wrapped to [-1, 1): the word's own overflow."""
        return self._wrap(a, 2.0, "ht")

    def wrap_turns(self, a: Node) -> Node:
        """``a`` turns wrapped to [-1/2, 1/2), likewise."""
        return self._wrap(a, 1.0, "turn")

    def _wrap(self, a: Node, period: float, unit: str) -> Node:
        half = 0.5 * period
        if a.kind == "const":
            return self.const((a.value + half) % period - half)
        limits = {"low": -half, "high": half, "unit": unit, "value": period}
        return self._new("wrap", a, key=period, **limits)

    def bounded(self, a: Node, low: float, high: float, reason: str, unless: str = "") -> Node:
        """``a`` in [low, high], as declared; a word outside saturates."""
        if a.kind == "const" and low <= a.value <= high:
            return a
        limits = {"low": low, "high": high, "source": f"declared: {reason}", "unless": unless}
        return self._new("bounded", a, key=(low, high), unit=a.unit, **limits)

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
