"""One update of a Kalman filter, as it is recorded: prediction, then a scalar update for each row.

What is recorded for the author carries the author's line: an element of P that of the state of its
row, an update that of its `Measurement`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from boresight.model import ops
from boresight.model.algebra import quaternion
from boresight.model.errors import InputError
from boresight.model.kalman.attitude import AttitudeView, corrected
from boresight.model.kalman.declared import Attitude, Measurement, axes_of, grouped, spread
from boresight.model.kalman.filter import Filter
from boresight.model.kalman.slopes import Intervals, Slope, Slopes, chosen, is_const, product
from boresight.model.lowering.trace import Condition, Scalar
from boresight.model.places import place_of_function, placed
from boresight.model.step import Values

__all__ = ["Update", "checked_measurements", "moved", "noise_of"]

#: Most by which one prediction may exceed the bound of a standard deviation.
_REACH = 64.0
#: Bound of an innovation over its standard deviation.
_MOVE = 64.0


class Update:
    """Records one update of ``kalman``: `results` has the next states and the outputs."""

    def __init__(self, kalman: Filter, x: Any, u: Any, p: Any) -> None:
        self.kalman, self.u, self.p = kalman, Values("input", grouped(kalman.inputs, u)), p
        leaf = getattr(x, kalman.states[0].name)
        self.tracer = leaf.tracer
        self.slopes, self.intervals = Slopes(self.tracer), Intervals(self.tracer)
        self.before = {s.name: getattr(x, s.name) for s in kalman.states}
        n = self.n = len(kalman.errors)
        self.range = range(n)
        #: P as far as it is known, and the bounds of its standard deviations.
        self.cov: dict[tuple[int, int], Scalar] = {}
        for name, (i, j) in kalman.covariance_states.items():
            self.cov[i, j] = self.cov[j, i] = self.before[name]
        self.wide = list(kalman.most)
        self.states: dict[str, Any] = {}
        self.memory: dict[str, Any] = {}
        #: Of each update: its L, and the innovation over its standard deviation.
        self.gains: list[list[Any]] = []
        self.moves: list[Any] = []
        self.nis: Any = 0.0

    def results(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Next states and outputs, by name."""
        k = self.kalman
        self._predict()
        prior = self._outputs(self.states) if k.prior else None
        self._correct()
        states = {**self.states, **self.memory, **self._reduced()}
        outputs = self._outputs(self.states) if prior is None else prior
        self.tracer.place = ""
        return states, outputs

    # -- prediction -----------------------------------------------------------------------------

    def _predict(self) -> None:
        """x = f(x), P = F P F^T + Q."""
        k = self.kalman
        for i, name in enumerate(k.errors):
            if name in self.before:
                self.slopes.seed(self.before[name], i)
        seen = self._seen(self.before)
        after = moved(k, k.f(seen, self.u, self.p), self.before)
        noise = noise_of(k, k.noise(seen, self.u, self.p), self.intervals)
        self.memory = {s.name: after[s.name] for s in k.memory}
        rows: list[Slope] = []
        for s in k.estimated:
            self.tracer.place = s.line
            if isinstance(s, Attitude):
                turn = [after[e] for e in s.errors]
                q = [self.before[c] for c in s.components]
                self.states |= zip(s.components, turned(q, turn), strict=True)
                rows += self._rows_of_turn(s, getattr(seen, s.name), turn)
            else:
                value = self.tracer.lift(after[s.name])
                rows.append(self.slopes.of(value))
                self.states[s.name] = value if value is self.before[s.name] else _within(value, s)
        self._propagate(rows, noise)

    def _rows_of_turn(self, s: Attitude, view: AttitudeView, turn: Sequence[Any]) -> list[Slope]:
        """Rows of F of an attitude's error: e + C d(turn)."""
        first = self.kalman.errors.index(s.errors[0])
        by = [self.slopes.of(self.tracer.lift(t)) for t in turn]
        rows = []
        for a in range(3):
            row: Slope = {first + a: self.tracer.const(1.0)}
            for b in range(3):
                for j, d in by[b].items():
                    part = product(d, self.tracer.lift(view.matrix[a][b]))
                    row[j] = row[j] + part if j in row else part
            rows.append(row)
        return rows

    def _propagate(self, rows: list[Slope], noise: dict[tuple[int, int], Any]) -> None:
        """F P F^T + Q, each row of F held where the variance is beyond its largest."""
        k, cov = self.kalman, self.cov
        full: list[Condition] = []
        diagonal: list[Scalar] = []
        for i in self.range:
            self.tracer.place = k.places[i]
            full.append(cov[i, i] > k.held[i])
            reach = self._reach(i, rows[i], noise.get((i, i), 0.0))
            self.wide[i] = min(max(reach, self.wide[i]), _REACH * self.wide[i])
            zero, one = self.tracer.const(0.0), self.tracer.const(1.0)
            diagonal.append(chosen(full[i], one, rows[i].pop(i, zero)))

        def across(i: int, column: Callable[[int], Any], added: Any = 0.0) -> Scalar:
            """Row i of F times a column; what comes of other states, and noise, unless held."""
            others = added
            for m in sorted(rows[i]):
                others = others + product(rows[i][m], column(m))
            own: Scalar = product(diagonal[i], column(i))
            return own if is_const(others, 0.0) else own + ops.where(full[i], 0.0, others)

        parts: dict[tuple[int, int], Scalar] = {}

        def along(i: int, j: int) -> Scalar:
            """(F P)_ij."""
            if (i, j) not in parts:
                parts[i, j] = across(i, [cov[m, j] for m in self.range].__getitem__)
            return parts[i, j]

        new: dict[tuple[int, int], Scalar] = {}
        for i, j in k.covariance_states.values():
            self.tracer.place = k.places[i]
            a, b = (i, j) if len(rows[j]) <= len(rows[i]) else (j, i)
            added = noise.get((i, j), 0.0)
            if i == j:
                added = added + k.least_noise[i]
            elif not is_const(added, 0.0):
                added = ops.where(full[a], 0.0, added)
            value = across(b, partial(along, a), added)
            new[i, j] = new[j, i] = self._element(value, i, j, self.wide)
        self.cov = new

    def _reach(self, i: int, row: Slope, variance: Any) -> float:
        """Largest standard deviation after a prediction that is not held."""
        k, size = self.kalman, self.intervals.size
        spread = sum(
            size(d) * (math.sqrt(k.held[j]) if i == j else k.most[j]) for j, d in row.items()
        )
        return math.sqrt(spread**2 + size(variance) + k.least_noise[i])

    def _element(self, value: Scalar, i: int, j: int, sd: Sequence[float]) -> Scalar:
        """An element of P within what the standard deviations allow."""
        if value is self.cov[i, j] and sd[i] * sd[j] >= self.kalman.most[i] * self.kalman.most[j]:
            return value
        low = 0.0 if i == j else -sd[i] * sd[j]
        bounded: Scalar = ops.bounded(value, low, sd[i] * sd[j], "standard deviations")
        return bounded

    def _dot(self, row: Mapping[int, Scalar], column: Callable[[int], Any]) -> Scalar:
        """Sum of products."""
        out: Any = 0.0
        for m in sorted(row):
            out = out + product(row[m], column(m))
        total: Scalar = self.tracer.lift(out)
        return total

    # -- correction -----------------------------------------------------------------------------

    def _correct(self) -> None:
        """x += L nu / sqrt(s) of every measurement; L of what the ones before it left of P."""
        k = self.kalman
        places = {s.name: s.line for s in k.estimated}
        current = dict(self.states)
        for i, name in enumerate(k.errors):
            if name in current:
                self.tracer.place = places[name]
                value = self.tracer.lift(current[name])
                current[name] = self.tracer.new("same", value, data=(f"predicted {name}",))
                self.slopes.seed(current[name], i)
        self.tracer.place = ""
        seen = self._seen(current)
        for m in checked_measurements(k, k.measure(seen, self.u, self.p)):
            self.tracer.place = m.line
            self._update(m)
        for s in k.estimated:
            self.tracer.place = s.line
            self._move(s)

    def _update(self, m: Measurement) -> None:
        row = self.slopes.of(self.tracer.lift(m.h))
        low, high = self.intervals(m.r)
        if not row or low <= 0.0:
            raise InputError.at(
                placed(m.line, "measurement"),
                wanted="a variance above 0" if row else "h that depends on a state",
                found=f"[{low:g}, {high:g}]" if row else "one that does not",
                fix="raise the least value of its parameters" if row else "compute h from x",
            )
        innovation = self._innovation(m)
        earlier = [self._dot(row, g.__getitem__) for g in self.gains]
        spread = self._spread(m, row)
        whole = [
            self._dot(row, [self.cov[j, i] for j in self.range].__getitem__) for i in self.range
        ]
        column = self._left(whole, row, earlier, spread)
        # h P h + r, not of the columns that are still to be reduced: known sooner.
        variance = self._dot(row, (whole if earlier else column).__getitem__)
        for a in earlier:
            variance = variance - a * a
        variance = variance + m.r
        if earlier or not _is_unit(row):  # else its interval is as good
            variance = ops.bounded(variance, low, spread * spread + high, "h P h + r")
        if m.valid is not None:
            column = [chosen(m.valid, c, self.tracer.const(0.0)) for c in column]
        for a, move in zip(earlier, self.moves, strict=True):
            innovation = innovation - a * move
        weight = ops.rsqrt(variance)
        move = ops.saturated(innovation * weight, _MOVE)
        if m.gate is not None:
            beyond = self._beyond(m.gate, innovation, variance)
            column = [chosen(beyond, self.tracer.const(0.0), c) for c in column]
            move = ops.where(beyond, 0.0, move)
        square = move * move
        self.nis = self.nis + (square if m.valid is None else ops.where(m.valid, square, 0.0))
        self.gains.append(
            [
                ops.bounded(c * weight, -sd, sd, "root of a variance")
                for c, sd in zip(column, self.wide, strict=True)
            ]
        )
        self.moves.append(move)

    def _innovation(self, m: Measurement) -> Any:
        nu = m.z - m.h
        return ops.wrap_ht(nu) if m.wrap else nu

    def _beyond(self, gate: float, innovation: Any, variance: Any) -> Any:
        """nu^2 > gate^2 s: known before the root of s."""
        limit = gate * math.sqrt(self.intervals(variance)[1])
        most = math.ldexp(1.0, math.frexp(limit)[1])
        nu = ops.saturated(innovation, most)
        return nu * nu > (gate * gate) * variance

    def _left(
        self, column: list[Any], row: Slope, earlier: Sequence[Scalar], spread: float
    ) -> list[Any]:
        """P h of what the updates before have left of P; ``earlier``: their h L."""
        if not earlier and _is_unit(row):
            return column
        out: list[Any] = []
        for i, value in enumerate(column):
            for g, a in zip(self.gains, earlier, strict=True):
                value = value - g[i] * a
            most = spread * self.wide[i]
            low = 0.0 if _is_unit(row) and i in row else -most
            out.append(ops.bounded(value, low, most, "standard deviations"))
        return out

    def _spread(self, m: Measurement, row: Slope) -> float:
        """Largest standard deviation of h, without the noise."""
        sizes = {j: self.intervals.size(h) for j, h in row.items()}
        for j, size in sizes.items():
            if not math.isfinite(size):
                raise InputError.at(
                    placed(m.line, "measurement"),
                    wanted=f"a derivative by {self.kalman.errors[j]} with a finite range",
                    found="an infinite one",
                    fix="bound what h divides by or takes a root of: ops.clip, ops.maximum",
                )
        return sum(size * self.wide[j] for j, size in sizes.items())

    def _move(self, s: Any) -> None:
        """The sum of all corrections of one state."""
        first = self.kalman.groups[s.name][0]
        at = self.kalman.errors.index(first)
        sums = []
        for i in range(at, at + len(self.kalman.groups[s.name])):
            value: Any = 0.0 if isinstance(s, Attitude) else self.states[s.name]
            for g, move in zip(self.gains, self.moves, strict=True):
                value = value + g[i] * move
            sums.append(value)
        if isinstance(s, Attitude):
            q = corrected(
                [self.states[c] for c in s.components], [ops.saturated(e, 1.0) for e in sums]
            )
            self.states |= zip(s.components, q, strict=True)
        else:
            self.states[s.name] = _within(sums[0], s)

    def _reduced(self) -> dict[str, Any]:
        """P - sum L L^T, each element once."""
        k, out = self.kalman, {}
        for name, (i, j) in k.covariance_states.items():
            self.tracer.place = k.places[i]
            value = self.cov[i, j]
            for g in self.gains:
                value = value - g[i] * g[j]
            out[name] = self._element(value, i, j, k.most)
        return out

    # -- views ----------------------------------------------------------------------------------

    def _seen(self, values: Mapping[str, Any]) -> Values:
        """States as the author's methods see them."""
        k, seen = self.kalman, {}
        scalars = [s for s in k.estimated if not isinstance(s, Attitude)]
        for s in k.estimated:
            if isinstance(s, Attitude):
                first = k.errors.index(s.errors[0])
                q = [values[c] for c in s.components]
                self.tracer.place = s.line
                seen[s.name] = AttitudeView(self.tracer, q, self.slopes, first)
        self.tracer.place = ""
        named = Values("state", {**self.before, **self.memory, **values})
        return Values("state", {**grouped([*scalars, *k.memory], named), **seen})

    def _outputs(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Outputs of these states."""
        k = self.kalman
        known = {"nis": self.nis, **self.memory, **values}
        known |= k.shown(self._seen(values), self.u, self.p)
        return {o.name: known[o.name] for o in k.outputs if o.name in known}


def _is_unit(row: Slope) -> bool:
    """Whether a measurement is that of one state itself."""
    return [is_const(h, 1.0) for h in row.values()] == [True]


def moved(kalman: Filter, given: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """What replaces each state and memory; of an attitude the turn, by the names of its errors.

    Raises
    ------
    InputError
        A name that is no state's.
    """
    groups = {
        **kalman.groups,
        **{s.name: (s.name,) for s in kalman.memory},
        **axes_of([s.name for s in kalman.memory]),
    }
    where = placed(place_of_function(kalman.f), f"f of {kalman.name}")
    found = spread(given, groups, where, "next values")
    names = (*kalman.errors, *(s.name for s in kalman.memory))
    return {name: found.get(name, before.get(name, 0.0)) for name in names}


def noise_of(
    kalman: Filter, given: Mapping[Any, Any], intervals: Intervals
) -> dict[tuple[int, int], Any]:
    """Variances and covariances of the process noise, by the numbers of two error states.

    Raises
    ------
    InputError
        A name that is no state's, or a variance that may be negative.
    """
    where = placed(place_of_function(kalman.noise), f"noise of {kalman.name}")
    single = {name: v for name, v in given.items() if not isinstance(name, tuple)}
    out: dict[tuple[int, int], Any] = {}
    for name, value in spread(single, kalman.groups, where, "noise").items():
        i = kalman.errors.index(name)
        if intervals(value)[0] < 0.0:
            raise InputError.at(
                f"{where}, {name}",
                wanted="a variance of 0 or more",
                found=f"one down to {intervals(value)[0]:g}",
                fix="raise the least value of its parameters, or take ops.maximum(v, 0.0)",
            )
        out[i, i] = value
    for pair in given.keys() - single.keys():
        i, j = sorted(kalman.errors.index(e) for e in _errors_of(kalman, pair, where))
        out[i, j] = given[pair]
    return out


def _errors_of(kalman: Filter, pair: tuple[Any, ...], where: str) -> tuple[str, ...]:
    """Two names of error states."""
    if len({*pair}) != 2 or not {*pair} <= {*kalman.errors}:
        raise InputError.at(
            where,
            wanted=f"pairs of {', '.join(kalman.errors)}",
            found=repr(pair),
            fix="name two different states whose noise is correlated",
        )
    return pair


def checked_measurements(kalman: Filter, given: Any) -> list[Measurement]:
    """What ``measure`` returned.

    Raises
    ------
    InputError
        No measurement, or something else.
    """
    several = isinstance(given, tuple | list)
    wrong = [m for m in given if not isinstance(m, Measurement)] if several else [given]
    if wrong or not given:
        raise InputError.at(
            placed(place_of_function(kalman.measure), f"measure of {kalman.name}"),
            wanted="a list of Measurement(z, h, r)",
            found=f"a {type(wrong[0]).__name__}" if wrong else "none",
            fix="return one for each scalar that is measured",
        )
    return list(given)


def turned(q: Sequence[Any], turn: Sequence[Any]) -> list[Any]:
    """Q dq of a turn [rad, body axes] of components up to half a radian."""
    half = [ops.saturated(0.5 * t, 0.25) for t in turn]
    after = quaternion.multiply(list(q), quaternion.increment(half))
    return [ops.bounded(c, -1.0, 1.0, "unit quaternion") for c in after]


def _within(value: Any, s: Any) -> Any:
    """A next value of a state in its range."""
    if s.unit == "ht":
        return value if isinstance(value, Scalar) and value.kind == "wrap" else ops.wrap_ht(value)
    return ops.bounded(value, s.low, s.high, "declared range of the state")
