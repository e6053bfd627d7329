"""The traced graph: what an estimator's ``step`` becomes when it runs on tracing scalars.

Nodes are created once per distinct expression (common sub-expressions merge), constants fold,
zeros and ones disappear. Every node carries an interval; a node whose interval cannot be known must
be bounded by its author (`model.ops.bounded`).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from boresight.model.errors import InputError
from boresight.model.words import rounded

__all__ = ["LEAVES", "Condition", "Graph", "Node"]

#: Kinds of nodes that have no arguments.
LEAVES = ("input", "param", "state", "const")


@dataclass(eq=False)
class Node:
    """One expression.

    ``signs`` belongs to kind "sum"; ``value`` to "const"; ``quarter`` to "sin" (cosine). ``line``
    is where its author wrote it: "file.py, line 41".
    """

    graph: Graph
    number: int
    kind: str
    args: tuple[Node, ...] = ()
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

    #: numpy's scalars and arrays leave the operators to this class.
    __array_ufunc__ = None

    # The numbers' protocol: everything goes through the graph.
    def __add__(self, other: Any) -> Node:
        return self.graph.add(self, 1, self.graph.lift(other), 1)

    def __sub__(self, other: Any) -> Node:
        return self.graph.add(self, 1, self.graph.lift(other), -1)

    def __mul__(self, other: Any) -> Node:
        return self.graph.mul(self, self.graph.lift(other))

    def __radd__(self, other: Any) -> Node:
        return self.graph.add(self.graph.lift(other), 1, self, 1)

    def __rsub__(self, other: Any) -> Node:
        return self.graph.add(self.graph.lift(other), 1, self, -1)

    __rmul__ = __mul__

    def __neg__(self) -> Node:
        return self.graph.neg(self)

    def __truediv__(self, other: Any) -> Node:
        if isinstance(other, (int, float)):
            return self * (1.0 / other)
        return self * self.graph.function("reciprocal", self.graph.lift(other))

    def __rtruediv__(self, other: Any) -> Node:
        return self.graph.lift(other) / self

    def __lt__(self, other: Any) -> Condition:
        return Condition(self.graph.add(self, 1, self.graph.lift(other), -1))

    def __gt__(self, other: Any) -> Condition:
        return Condition(self.graph.add(self.graph.lift(other), 1, self, -1))

    def __ge__(self, other: Any) -> Condition:
        return ~self.__lt__(other)

    def __le__(self, other: Any) -> Condition:
        return ~self.__gt__(other)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        raise TypeError("traced values compare with < > <= >= only, not with == or !=")

    __hash__ = object.__hash__

    def __bool__(self) -> bool:
        raise TypeError("a traced value has no truth value: use model.ops.where instead of if")

    def __repr__(self) -> str:
        return f"<{self.label} {self.kind} [{self.low:.6g}, {self.high:.6g}]>"

    @property
    def label(self) -> str:
        """The name, or the kind with the number."""
        return self.name or f"{self.kind}_{self.number}"


@dataclass(frozen=True, eq=False)
class Condition:
    """True where ``node`` is negative (or, inverted, where it is not)."""

    node: Node
    inverted: bool = False

    def __invert__(self) -> Condition:
        return Condition(self.node, not self.inverted)

    def __and__(self, other: Condition) -> Condition:
        # One selection: where self holds, other's node decides; elsewhere a constant that fails.
        g = self.node.graph
        # The failing constant must survive the binary point of other's node: take its magnitude.
        bound = max(-other.node.low, other.node.high) or 1.0
        fails = g.const(-bound if other.inverted else 0.0)
        return Condition(g.select(self, other.node, fails), other.inverted)

    def __or__(self, other: Condition) -> Condition:
        return ~(~self & ~other)

    def __bool__(self) -> bool:
        raise TypeError("a traced condition has no truth value: use model.ops.where")


#: Value of a function of a constant.
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sin": rounded.sin_ht,
    "asin": rounded.asin_ht,
    "rsqrt": rounded.rsqrt,
    "reciprocal": lambda x: 1.0 / x,
}


_MODEL = Path(__file__).parent.parent
#: Files whose lines nobody wrote an estimator in.
_OWN = frozenset(
    str(_MODEL / name) for name in ("lowering/graph.py", "ops.py", "lowering/lower.py")
)
#: The file that makes the leaves, which have no line: their declarations say what they are.
_CALLER = str(_MODEL / "estimator.py")


def _author_line() -> str:
    """The line that asks for a node: the innermost one outside the tracer."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None and (
        frame.f_code.co_filename in _OWN or frame.f_code.co_filename.startswith("<")
    ):
        frame = frame.f_back
    if frame is None or frame.f_code.co_filename == _CALLER:
        return ""
    return f"{frame.f_code.co_filename.rpartition('/')[2]}, line {frame.f_lineno}"


class Graph:
    """Builds nodes; one graph per trace."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.nodes: list[Node] = []
        self._unique: dict[Any, Node] = {}

    def _new(
        self, kind: str, args: tuple[Node, ...] = (), *, key: Any = None, **attributes: Any
    ) -> Node:
        key = (kind, tuple(a.number for a in args), key)
        if key in self._unique:
            return self._unique[key]
        node = Node(self, len(self.nodes), kind, args, line=_author_line(), **attributes)
        self.nodes.append(node)
        self._unique[key] = node
        return node

    def leaf(self, kind: str, name: str, low: float, high: float, unit: str = "") -> Node:
        """An input, parameter or state with its declared range."""
        return self._new(
            kind, key=name, name=name, low=low, high=high, source="declared", unit=unit
        )

    def const(self, value: float) -> Node:
        """A constant."""
        value = float(value) + 0.0
        if not math.isfinite(value):
            raise InputError(f"{self.name}: constants must be finite, not {value!r}")
        return self._new("const", key=value, value=value, low=value, high=value, source="constant")

    def lift(self, x: Any) -> Node:
        """A node as it is, a number as a constant."""
        return x if isinstance(x, Node) else self.const(x)

    def neg(self, a: Node) -> Node:
        """-a."""
        return self.add(self.const(0.0), 1, a, -1)

    def add(self, a: Node, sign_a: int, b: Node, sign_b: int) -> Node:
        """sign_a * a + sign_b * b."""
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
        nodes = tuple(n for n, _ in terms)
        signs = tuple(s for _, s in terms)
        low = sum(n.low if s > 0 else -n.high for n, s in terms)
        high = sum(n.high if s > 0 else -n.low for n, s in terms)
        return self._new("sum", nodes, key=signs, signs=signs, low=low, high=high)

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
            return self._new("mul", (a, b), low=low, high=edges[1])
        corners = [x * y if x and y else 0.0 for x in (a.low, a.high) for y in (b.low, b.high)]
        return self._new("mul", (a, b), low=min(corners), high=max(corners))

    def select(self, condition: Condition, yes: Node, no: Node) -> Node:
        """``yes`` where the condition holds, else ``no``."""
        if condition.inverted:
            yes, no = no, yes
        c = condition.node
        if c.high < 0.0 or yes is no:
            return yes
        if c.low >= 0.0:
            return no
        return self._new(
            "select", (c, yes, no), low=min(yes.low, no.low), high=max(yes.high, no.high)
        )

    def flip(self, condition: Condition, a: Node) -> Node:
        """-a where the condition holds, else a."""
        c = condition.node
        certain = True if c.high < 0.0 else False if c.low >= 0.0 else None
        if certain is not None:
            return self.neg(a) if certain != condition.inverted else a
        if condition.inverted:
            return self.neg(self.flip(~condition, a))
        bound = max(abs(a.low), abs(a.high))
        return self._new("flip", (c, a), low=-bound, high=bound)

    def absolute(self, a: Node) -> Node:
        """|a|."""
        if a.low >= 0.0:
            return a
        if a.high <= 0.0:
            return self.neg(a)
        return self._new("abs", (a,), low=0.0, high=max(-a.low, a.high))

    def wrap(self, a: Node) -> Node:
        """``a`` half turns wrapped to [-1, 1): the word's own overflow."""
        if a.kind == "const":
            return self.const((a.value + 1.0) % 2.0 - 1.0)
        return self._new("wrap", (a,), low=-1.0, high=1.0, unit="ht")

    def bounded(self, a: Node, low: float, high: float, reason: str) -> Node:
        """``a``, known (or made, by saturation) to lie in [low, high]."""
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise InputError(
                f"{self.name}: the range of {a.label} must be finite and ordered, "
                f"not [{low:g}, {high:g}]"
            )
        if a.kind == "const" and low <= a.value <= high:
            return a
        return self._new(
            "bounded",
            (a,),
            key=(low, high),
            low=low,
            high=high,
            source=f"declared: {reason}",
            unit=a.unit,
        )

    def saturated(self, a: Node, limit: float) -> Node:
        """``a`` clamped to [-limit, limit), a power of two, by the word's own overflow."""
        if math.frexp(limit)[0] != 0.5:
            raise ValueError(f"limit must be a power of two, not {limit!r}")
        if -limit <= a.low and a.high < limit:
            return a
        low, high = (min(max(edge, -limit), limit) for edge in (a.low, a.high))
        if low == high:
            return self.const(low)
        return self._new(
            "saturated",
            (a,),
            key=limit,
            value=limit,
            low=low,
            high=high,
            source="saturated on purpose",
            unit=a.unit,
        )

    def function(self, kind: str, a: Node, *, quarter: bool = False) -> Node:
        """sin (cosine with ``quarter``), asin, rsqrt, reciprocal of one argument.

        The sine's argument is in half turns, any number of them; that of asin lies in [0, 0.72).
        """
        if kind == "reciprocal" and a.low <= 0.0 <= a.high:
            line = _author_line()
            raise InputError(
                f"{line + ': ' if line else ''}{self.name}: reciprocal of {a.label}: its range "
                f"[{a.low:g}, {a.high:g}] must exclude 0; clip it first"
            )
        if a.kind == "const" and not (kind == "rsqrt" and a.value <= 0.0):
            return self.const(_FUNCTIONS[kind](a.value + 0.5 * quarter))
        if kind == "sin":
            if a.low < -1.0 or (a.high >= 1.0 and a.unit != "ht"):
                a = self.wrap(a)
            return self._new("sin", (a,), key=quarter, quarter=quarter, low=-1.0, high=1.0)
        if kind == "asin":
            return self._new("asin", (a,), low=0.0, high=0.26, unit="ht")
        if kind == "rsqrt":
            low = 0.0 if a.high <= 0 else 1.0 / math.sqrt(a.high)
            high = math.inf if a.low <= 0 else 1.0 / math.sqrt(a.low)
            return self._new("rsqrt", (a,), low=low, high=high)
        if kind == "reciprocal":
            return self._new("reciprocal", (a,), low=1.0 / a.high, high=1.0 / a.low)
        raise ValueError(f"unknown function {kind!r}")
