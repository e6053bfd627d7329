"""Derivatives and intervals of the expressions that a tracer has recorded so far."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.model import ops
from boresight.model.lowering.graph import Graph
from boresight.model.lowering.trace import Condition, Expression, Scalar, Tracer

#: Derivatives by the number of an error state; missing ones are zero.
Slope = dict[int, Scalar]


def is_const(x: Any, number: float) -> bool:
    """Whether this is the constant ``number``, recorded or not."""
    if isinstance(x, Scalar):
        return x.kind == "const" and bool(x.data[0] == number)
    return isinstance(x, int | float) and x == number


def product(a: Scalar, b: Scalar) -> Scalar:
    """a b, the constant 0 where one of them is."""
    return a if is_const(a, 0.0) else b if is_const(b, 0.0) else a * b


def total(*slopes: Mapping[int, Scalar]) -> Slope:
    """The sum of derivatives."""
    out: Slope = {}
    for slope in slopes:
        for k, value in slope.items():
            out[k] = out[k] + value if k in out else value
    return {k: v for k, v in out.items() if not is_const(v, 0.0)}


def _times(slope: Mapping[int, Scalar], factor: Scalar | float) -> Slope:
    if isinstance(factor, Scalar):
        return {k: product(v, factor) for k, v in slope.items()}
    return {k: -v if factor < 0.0 else v for k, v in slope.items()}


def chosen(condition: Any, yes: Any, no: Any) -> Any:
    """`ops.where`, without a selection between two that are the same."""
    equal = yes is no or (
        isinstance(yes, Scalar) and yes.kind == "const" and is_const(no, yes.data[0])
    )
    return yes if equal else ops.where(condition, yes, no)


class Slopes:
    """Derivatives of recorded expressions by error states, in forward mode: sparse and exact.

    A comparison has none; a selection has that of the side chosen.
    """

    def __init__(self, tracer: Tracer) -> None:
        self.tracer = tracer
        self._slopes: dict[int, Slope] = {}
        self._added: dict[int, Slope] = {}

    def seed(self, x: Scalar, error: int) -> None:
        """Let ``x`` be the state of this error, with derivative 1."""
        self._slopes[x.number] = {error: self.tracer.const(1.0)}

    def add(self, x: Scalar, slope: Slope) -> None:
        """Add a derivative of ``x`` to that by its arguments."""
        self._added[x.number] = slope

    def of(self, x: Scalar) -> Slope:
        """d x / d error, by error."""
        pending: dict[int, Expression] = {}
        stack: list[Expression] = [x]
        while stack:
            e = stack.pop()
            if e.number not in self._slopes and e.number not in pending:
                pending[e.number] = e
                stack.extend(e.args)
        before = self.tracer.place
        for _, e in sorted(pending.items()):
            self.tracer.place = e.line or before
            self._slopes[e.number] = total(self._derived(e), self._added.get(e.number, {}))
        self.tracer.place = before
        return self._slopes[x.number]

    def _derived(self, e: Expression) -> Slope:
        slopes = [self._slopes[a.number] for a in e.args]
        if isinstance(e, Condition) or not any(slopes):
            return {}
        assert isinstance(e, Scalar)
        if by := ops.OPERATIONS[e.kind].slopes:
            factors = (d(e, *e.args) if callable(d) else d for d in by)
            return total(*(_times(s, d) for s, d in zip(slopes, factors, strict=True)))
        return getattr(self, f"_{e.kind}")(e, *slopes)  # type: ignore[no-any-return]

    def _select(self, e: Scalar, c: Slope, yes: Slope, no: Slope) -> Slope:
        zero = self.tracer.const(0.0)
        return {
            k: chosen(e.args[0], yes.get(k, zero), no.get(k, zero)) for k in sorted({*yes, *no})
        }

    def _flip(self, e: Scalar, c: Slope, a: Slope) -> Slope:
        return {k: ops.flip(e.args[0], v) for k, v in a.items()}

    def _absolute(self, e: Scalar, a: Slope) -> Slope:
        return {k: ops.flip(e.args[0] < 0.0, v) for k, v in a.items()}

    def _larger(self, e: Scalar, a: Slope, b: Slope) -> Slope:
        zero, first = self.tracer.const(0.0), e.args[1] < e.args[0]
        return {k: chosen(first, a.get(k, zero), b.get(k, zero)) for k in sorted({*a, *b})}

    def _smaller(self, e: Scalar, a: Slope, b: Slope) -> Slope:
        return self._larger(e, b, a)

    def _clip(self, e: Scalar, a: Slope) -> Slope:
        inside = (e.args[0] > e.data[0]) & (e.args[0] < e.data[1])
        return {k: ops.where(inside, v, 0.0) for k, v in a.items()}


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
        for e in self._tracer.expressions[len(self._nodes) : x.number + 1]:
            self._graph.line = e.line
            args = (self._nodes[a.number] for a in e.args)
            self._nodes.append(getattr(self._graph, e.kind)(*args, *e.data))
        node = self._nodes[x.number]
        return node.low, node.high

    def size(self, x: Any) -> float:
        """Largest magnitude."""
        low, high = self(x)
        return max(abs(low), abs(high))
