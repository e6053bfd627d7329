"""Derivatives of recorded expressions, and attitudes, whose derivatives are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model import ops
from boresight.model.algebra import quaternion
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
    constant = isinstance(yes, Scalar) and yes.kind == "const"
    equal = yes is no or (constant and is_const(no, yes.data[0]))
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


class AttitudeView:
    """An attitude q (4,), body to navigation, with its error e: C_true = (1 + [e x]) C.

    Derivatives by e, whose first component has the number ``first``, are noted in ``slopes``; none
    are without it. ``estimate``: attitude at which e is zero, where q is another one on purpose.
    """

    def __init__(
        self,
        tracer: Tracer,
        q: Sequence[Any],
        slopes: Slopes | None = None,
        first: int = 0,
        estimate: Sequence[Any] | None = None,
    ) -> None:
        self._tracer, self._slopes, self._first = tracer, slopes, first
        self._q = list(q)
        self._c = quaternion.matrix(self._q)
        self._estimate = self._c if estimate is None else quaternion.matrix(estimate)

    @property
    def q(self) -> list[Any]:
        """Components w, x, y, z; d q / d e = (0, e) q / 2."""
        if self._slopes is None:
            return self._q
        units = [[0.5 * (m == k) for k in range(3)] for m in range(3)]
        return [*self._duals(self._q, [quaternion.vector_times(unit, self._q) for unit in units])]

    @property
    def matrix(self) -> list[list[Any]]:
        """C of the estimate, body to navigation, without derivatives."""
        return self._estimate

    def to_nav(self, v: Sequence[Any]) -> Any:
        """C v [of v's unit]; its derivative by e is e x (C v)."""
        n = quaternion.turn(self._c, v)
        return self._duals(n, [[-c for c in _times_unit(n, m)] for m in range(3)])

    def to_body(self, v: Sequence[Any]) -> Any:
        """C^T v; its derivative by e is C^T (v x e)."""
        turned = quaternion.conjugate_turn(self._c, v)
        by_e = [quaternion.conjugate_turn(self._c, _times_unit(v, m)) for m in range(3)]
        return self._duals(turned, by_e)

    def observed(self, measured: Sequence[Any], expected: Sequence[Any]) -> tuple[Any, Any]:
        """z and h, each (3,), of a vector that is known in navigation axes and seen in body axes.

        z = C b of the measured b; h = r, and as h(e) = C C_true^T r its derivative by e is r x e:
        constant, whatever the attitude is.
        """
        z = _array(quaternion.turn(self._estimate, measured))
        if self._slopes is None:
            body = quaternion.conjugate_turn(self._c, expected)
            return z, _array(quaternion.turn(self._estimate, body))
        return z, self._duals(expected, [_times_unit(expected, m) for m in range(3)])

    def _duals(self, values: Sequence[Any], by_e: Sequence[Sequence[Any]]) -> Any:
        return _array(self._dual(v, [d[k] for d in by_e]) for k, v in enumerate(values))

    def _dual(self, value: Any, by_e: Sequence[Any]) -> Scalar:
        """``value`` with derivatives by the components of e besides its own."""
        lift, tracer = self._tracer.lift, self._tracer
        x = lift(value)
        if self._slopes is None:
            return x
        x = tracer.new("same", x, data=(f"turned {len(tracer.expressions)}",))
        slope = {self._first + m: lift(d) for m, d in enumerate(by_e)}
        self._slopes.add(x, {k: d for k, d in slope.items() if not is_const(d, 0.0)})
        return x


def _array(values: Any) -> Any:
    return np.array(list(values), dtype=object)


def _times_unit(v: Sequence[Any], m: int) -> list[Any]:
    out: list[Any] = [0.0, 0.0, 0.0]
    out[(m + 1) % 3] = v[(m + 2) % 3]
    out[(m + 2) % 3] = -v[(m + 1) % 3]
    return out
