"""One update of a Kalman filter, as it is recorded: prediction, then a scalar update for each row.

Recorded expressions carry a line of the author: an element of P the line of its row's state, an
update the line of its `Measurement`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from boresight.model import ops
from boresight.model.algebra import quaternion
from boresight.model.errors import InputError, closest, place_of_function, placed, require
from boresight.model.estimator import Size
from boresight.model.kalman import declared
from boresight.model.kalman.declared import Attitude, Measurement
from boresight.model.kalman.slopes import AttitudeView, Slope, Slopes, chosen, is_const, product
from boresight.model.lowering.graph import Intervals
from boresight.model.lowering.trace import Condition, Expression, Scalar
from boresight.model.step import Values, check_number
from boresight.model.units import linear, same_unit
from boresight.model.words.rounded import sum_of

if TYPE_CHECKING:
    from boresight.model.kalman.kalman import Kalman

#: Most by which one prediction may exceed the bound of a standard deviation.
_REACH = 64.0
#: Largest innovation that counts, in standard deviations.
MOST_SD = 64.0
#: Name of the state that holds the random word of `Kalman.dither`.
DITHER = "dither"
#: The next word is wrap(factor word + added): all 2^32 words in turn.
_FACTOR, _ADDED = 69069.0, 1327217885.0 * 2.0**-31
#: A sum with this number ends at the bit 2^-13 of a word of 32, and is exact in float64.
_COARSE = 2.0**17
#: Reasons of the ranges of elements of P, and of an innovation's variance.
_SD, SPREAD = "standard deviations", "h P h + r"
#: When an element leaves the bounds that it has in a covariance.
INDEFINITE = "rounding or nonlinearity make P indefinite"
#: In `Estimator.remedies` before the line of a state: what narrows the ranges of its predicted P.
PREDICTED = "predicted P, "
#: When a value leaves the bounds that `Measurement.sd_max` gives it.
CLAIMED = "h is less certain than sd_max of its Measurement"
#: Share of the largest part of a standard deviation from which a message names a part.
_NAMED = 0.25
#: Multiple of a largest standard deviation beyond which a message names what it grows by.
_GROWN = 2.5


class Update:
    """Records one update of ``kalman``: `results` has the next states and the outputs."""

    def __init__(self, kalman: Kalman, x: Any, u: Any, p: Any) -> None:
        self.kalman, self.u, self.p = kalman, Values("input", declared.grouped(kalman.inputs, u)), p
        self.tracer = getattr(x, kalman.states[0].name).tracer
        self.slopes, self.intervals = Slopes(self.tracer), Intervals(self.tracer)
        self.before = {s.name: getattr(x, s.name) for s in kalman.states}
        self.range = range(len(kalman.errors))
        #: P as far as it is known, and the bounds of its standard deviations.
        self.cov: dict[tuple[int, int], Scalar] = {}
        for name, (i, j) in kalman.covariance_states.items():
            self.cov[i, j] = self.cov[j, i] = self.before[name]
        self.bounds = list(kalman.largest_sd)
        named = zip(kalman.errors, kalman.places, kalman.largest_sd, strict=True)
        kalman.sizes = [
            Size("sd_max", name, line, sd, sd, self.cov[i, i].number)
            for i, (name, line, sd) in enumerate(named)
        ]
        #: Of each error state: others that take its standard deviation beyond `_GROWN` in a
        #: prediction.
        self.growth: dict[int, list[int]] = {}
        self.states: dict[str, Any] = {}
        self.memory: dict[str, Any] = {}
        #: Elements of P from which updates have been subtracted, and how many.
        self.reductions: dict[tuple[int, int], tuple[Any, int]] = {}
        #: Of each update: its L, the innovation over its standard deviation, whether it counts.
        self.gains: list[list[Any]] = []
        self.moves: list[Any] = []
        self.conditions: list[Condition | None] = []
        #: Outputs about the measurements: those that count, and those beyond their gate.
        self.counts: dict[str, Any] = {"nis": 0.0, "accepted": 0.0, "rejected": 0.0}
        #: What each gate decides, by its measurement's number.
        self.decisions: dict[str, Any] = {}

    def results(self) -> tuple[dict[str, Any], dict[str, Any]]:
        k = self.kalman
        self._predict()
        prior = self._outputs(self.states) if k.prior else None
        self._correct()
        reduced = self._reduced()
        self.cov = {pair: reduced[name] for name, pair in k.covariance_states.items()}
        states = {**self.states, **self.memory, **reduced}
        outputs = self._outputs(self.states) if prior is None else prior
        for name in {*outputs} & {*self.counts}:
            outputs[name] = self.counts[name]  # not known before the correction
        self.tracer.place = ""
        return states, outputs

    # -- prediction -----------------------------------------------------------------------------

    def _predict(self) -> None:
        """x = f(x), P = F P F^T + Q."""
        k = self.kalman
        for s in k.scalars:
            self.slopes.seed(self.before[s.name], k.errors.index(s.name))
        view = self._view(self.before)
        after = moved(k, k.f(view, self.u, self.p), self.before)
        noise = noise_of(k, k.noise(view, self.u, self.p), self.intervals)
        self.memory = {s.name: after[s.name] for s in k.memory}
        rows: list[Slope] = []
        for state in k.estimated:
            self.tracer.place, name = state.line, state.name
            if isinstance(state, Attitude):
                turn = [after[e] for e in state.errors]
                q = [self.before[c] for c in state.components]
                self.states |= zip(state.components, turned(q, turn), strict=True)
                rows += self._rows_of_turn(state, getattr(view, name), turn)
            else:
                value = self.tracer.lift(after[name])
                rows.append(self.slopes.of(value))
                self.states[name] = value if value is self.before[name] else in_range(value, state)
        self._propagate(rows, noise)

    def _rows_of_turn(self, s: Attitude, view: AttitudeView, turn: Sequence[Any]) -> list[Slope]:
        """Rows of F of an attitude's error: e + C d(turn)."""
        first = self.kalman.errors.index(s.errors[0])
        slopes = [self.slopes.of(self.tracer.lift(t)) for t in turn]
        rows = []
        for a in range(3):
            row: Slope = {first + a: self.tracer.const(1.0)}
            for b in range(3):
                for j, d in slopes[b].items():
                    part = product(d, self.tracer.lift(view.matrix[a][b]))
                    row[j] = row[j] + part if j in row else part
            rows.append(row)
        return rows

    def _propagate(self, rows: list[Slope], noise: dict[tuple[int, int], Any]) -> None:
        """F P F^T + Q, each row of F held where the variance is near its largest.

        F is a product of factors: each changes some states by others that have not changed yet;
        states whose equations need each other change together.
        """
        k = self.kalman
        self.random = self._random() if k.dither else None
        self.full: list[Condition] = []
        self.diagonal: list[Scalar] = []
        self.rows: list[Slope] = []
        for i in self.range:
            self.tracer.place = k.places[i]
            self.full.append(self.cov[i, i] > k.variance_limits[i])
            reach = self._reach(i, rows[i], noise.get((i, i), 0.0))
            self.bounds[i] = min(max(reach, self.bounds[i]), _REACH * self.bounds[i])
            zero, one = self.tracer.const(0.0), self.tracer.const(1.0)
            self.diagonal.append(chosen(self.full[i], one, rows[i].pop(i, zero)))
            self.rows.append({m: self._entry(i, m, d) for m, d in rows[i].items()})
            if self.growth[i]:
                k.remedies[PREDICTED + k.places[i]] = self._less_growth([i])
        changed: set[int] = set()
        for block in _blocks(rows):
            changed |= {*block}
            added = {
                (i, j): q for (i, j), q in noise.items() if {i, j} <= changed and {i, j} & {*block}
            }
            self._change(block, added)

    def _entry(self, i: int, m: int, entry: Scalar) -> Scalar:
        """An element of F in a word 32 times as fine as its share of P needs: shorter products."""
        k = self.kalman
        limit = math.ldexp(2.0**-5, math.frexp(k.largest_sd[i] / k.largest_sd[m])[1])
        if entry.kind == "const" or self.intervals.size(entry) >= limit:
            return entry
        return cast(Scalar, ops.bounded(entry, -limit, limit, _SD))

    def _change(self, block: Sequence[int], noise: Mapping[tuple[int, int], Any]) -> None:
        """P after the states of ``block`` alone have moved, by the others and one another."""
        k, before = self.kalman, dict(self.cov)
        along: dict[tuple[int, int], Scalar] = {}
        for i in block:
            self.tracer.place = k.places[i]
            for j in self.range:
                along[i, j] = self._row_product(i, j, [before[m, j] for m in self.range])
                if j not in block:
                    added = noise.get((min(i, j), max(i, j)), 0.0)
                    along[i, j] = self._bounded(along[i, j], i, j, before)
                    self.cov[i, j] = self.cov[j, i] = self._with_noise(along[i, j], i, j, added)
        for n, i in enumerate(block):
            for j in block[n:]:
                self.tracer.place = k.places[i]
                a, b = (i, j) if len(self.rows[j]) <= len(self.rows[i]) else (j, i)
                column = [along.get((a, m), before[a, m]) for m in self.range]
                added = noise.get((i, j), 0.0)
                if i == j:
                    value = self._row_product(b, a, column, added + k.noise_floor[i])
                else:
                    value = self._with_noise(self._row_product(b, a, column), i, j, added)
                self.cov[i, j] = self.cov[j, i] = self._bounded(value, i, j, before)

    def _random(self) -> Any:
        """0 in float64; in words of 32 bits a random number within 2^-14 of it.

        It is the rounding error of the state's word.
        """
        word = self.before[DITHER]
        coarse = ops.bounded(word + _COARSE, _COARSE - 1.0, _COARSE + 1.0, "a word")
        return ops.saturated(word - ops.bounded(coarse - _COARSE, -1.0, 1.0, "a word"), 2.0**-14)

    def _row_product(self, i: int, j: int, column: Sequence[Any], added: Any = 0.0) -> Scalar:
        """Row i of F times column j; terms of other states, and noise, only if it is not held."""
        coupling = _dot(self.rows[i], column, added)
        result: Scalar = product(self.diagonal[i], column[i])
        if not is_const(coupling, 0.0):
            if self.random is not None:  # within half of the last bit of a word of 32
                exponent = math.frexp(self.bounds[i] * self.bounds[j])[1]
                coupling = coupling + math.ldexp(1.0, exponent - 18) * self.random
            result = result + ops.where(self.full[i], 0.0, coupling)
        return result

    def _with_noise(self, value: Scalar, i: int, j: int, added: Any) -> Scalar:
        """An element of two states with the covariance of their noise, unless one is held."""
        if is_const(added, 0.0):
            return value
        return value + cast(Scalar, ops.where(self.full[i] | self.full[j], 0.0, added))

    def _bounded(self, value: Any, i: int, j: int, before: Mapping[tuple[int, int], Any]) -> Any:
        return value if value is before[i, j] else self._element(value, i, j, self.bounds)

    def _reach(self, i: int, row: Slope, variance: Any) -> float:
        """Largest standard deviation after a prediction that is not held."""
        k, size = self.kalman, self.intervals.size
        parts = {
            j: size(d) * (math.sqrt(k.variance_limits[j]) if i == j else k.largest_sd[j])
            for j, d in row.items()
        }
        spread, noise = math.fsum(parts.values()), size(variance) + k.noise_floor[i]
        own = math.hypot(parts.pop(i, 0.0), math.sqrt(noise))
        grows = math.hypot(spread, math.sqrt(noise)) > _GROWN * max(k.largest_sd[i], own)
        self.growth[i] = _largest(parts) if grows else []
        return math.sqrt(spread * spread + noise)

    def _element(self, value: Any, i: int, j: int, sd: Sequence[float]) -> Scalar:
        """An element of P within what standard deviations allow."""
        return _claimed(value, 0.0 if i == j else -sd[i] * sd[j], sd[i] * sd[j])

    # -- correction -----------------------------------------------------------------------------

    def _correct(self) -> None:
        """x += L nu / sqrt(s) of every measurement; L of P after the measurements before it."""
        k = self.kalman
        current = dict(self.states)
        self.slopes = Slopes(self.tracer)  # by the errors of the predicted state, no others
        for s in k.scalars:
            self.tracer.place = s.line
            value = self.tracer.lift(current[s.name])
            value = self.tracer.new("same", value, data=(f"predicted {s.name}",))
            if s.unit:
                self.tracer.units[value.number] = s.unit, s.high - s.low
            self.slopes.seed(value, k.errors.index(s.name))
            current[s.name] = value
        self.tracer.place = ""
        view = self._view(current)
        for m in measurements_of(k, view, self.u, self.p):
            self.tracer.place = m.line
            self._update(m)
        for estimated in k.estimated:
            self.tracer.place = estimated.line
            self._move(estimated)

    def _update(self, m: Measurement) -> None:
        row, where = self.slopes.of(self.tracer.lift(m.h) - m.z), placed(m.line, "measurement")
        wanted = "h that depends on a state"
        require(bool(row), where, wanted, "one that does not", "compute h from x")
        low, high = self.intervals(m.r)
        fix = "raise the least value of its parameters" if low < high else "give the noise's"
        require(low > 0.0, where, "a variance above 0", f"[{low:g}, {high:g}]", fix)
        slope_max = declared.spread(m.slope_max, self.kalman.groups, where, "slope_max")
        for name, limit in slope_max.items():
            i = self.kalman.errors.index(name)
            stated = math.ldexp(0.5, math.frexp(limit * m.turn)[1])  # a power of two, or the last
            if i in row and self.intervals.size(row[i]) > limit:
                size = Size("slope_max", name, m.line, stated, limit, row[i].number)
                self.kalman.sizes.append(size)
                row = {**row, i: ops.saturated(row[i], limit)}
        innovation = self._innovation(m)
        sd, unless = self._spread(m, row)
        # |h L| <= sqrt(h P h), by Cauchy and Schwarz.
        dots = [self._within(_dot(row, g), sd, unless) for g in self.gains]
        full_column = [_dot(row, [self.cov[j, i] for j in self.range]) for i in self.range]
        column = self._reduced_column(full_column, row, dots, sd, unless)
        # h P h + r, not of the columns that are still to be reduced: known sooner.
        variance = _dot(row, full_column if dots else column)
        if not _is_unit(row):
            size = Size("sd_max", "", m.line, sd * m.turn, sd, self.tracer.lift(variance).number)
            self.kalman.sizes.append(size)
        variance = self._subtracted(variance, [a * a for a in dots]) + m.r
        if dots or not _is_unit(row):  # else its interval is as good
            variance = _claimed(variance, low, sd * sd + high, SPREAD, unless)
        pairs = zip(dots, self.moves, strict=True)
        innovation = self._subtracted(innovation, [a * move for a, move in pairs])
        weight = ops.rsqrt(variance)
        move = ops.saturated(innovation * weight, MOST_SD)
        valid, pairs = m.valid, zip(column, self.bounds, strict=True)
        gains = [_claimed(c * weight, -most, most, "root of a variance") for c, most in pairs]
        if m.gate is not None:
            # A condition of its own: cheaper once for each L than wherever these are used.
            limit = m.gate * math.sqrt(self.intervals(variance)[1])
            nu = ops.saturated(innovation, math.ldexp(1.0, math.frexp(limit)[1]))
            beyond = nu * nu > (m.gate * m.gate) * variance  # known before the root
            within = ~beyond if valid is None else ~beyond & valid
            beyond = beyond if valid is None else beyond & valid
            for name, condition in (("rejected", beyond), ("accepted", within)):
                decision = ops.where(condition, 1.0, 0.0)
                self.counts[name] += decision
                self.decisions[f"gate_{name}_{len(self.moves)}"] = decision
            gains = [ops.where(within, g, 0.0) for g in gains]
            move, valid = ops.where(within, move, 0.0), None
        else:
            self.counts["accepted"] += _if_valid(valid, 1.0)
        self.counts["nis"] += _if_valid(valid, move * move)
        self.gains.append(gains)
        self.moves.append(move)
        self.conditions.append(valid)

    def _subtracted(self, value: Any, parts: Sequence[Any], first: int = 0) -> Any:
        """Value minus the part of each update from ``first`` on that is taken into account."""
        for _, group in groupby(enumerate(parts, first), lambda part: id(self.conditions[part[0]])):
            numbers, members = zip(*group, strict=True)
            value = value - _if_valid(self.conditions[numbers[0]], sum_of(members))
        return value

    def _innovation(self, m: Measurement) -> Any:
        try:
            return ops.wrap_ht(m.z - m.h) if m.wrap else m.z - m.h
        except InputError as error:  # of another unit: no line of the author is running
            where = placed(m.line, "measurement, wrap")
            raise InputError.at(**{**error.parts, "where": where}) from None

    def _reduced_column(
        self, column: list[Any], row: Slope, dots: Sequence[Scalar], spread: float, unless: str
    ) -> list[Any]:
        """P h of P after the updates before; ``dots``: their h L."""
        if _is_unit(row):
            return [self._reduced_element(i, *row) for i in self.range]
        out: list[Any] = []
        for value, sd, *g in zip(column, self.bounds, *self.gains, strict=True):
            bound = spread * sd
            value = self._subtracted(value, [a * b for a, b in zip(g, dots, strict=True)])
            out.append(_claimed(value, -bound, bound, unless=unless))
        return out

    def _reduced_element(self, i: int, j: int) -> Any:
        """An element of P after the updates so far; each is subtracted once."""
        value, count = self.reductions.get((i, j), (self.cov[i, j], 0))
        if count < len(self.gains):
            value = self._element(self._reduced_by(i, j, value, count), i, j, self.bounds)
            self.reductions[i, j] = self.reductions[j, i] = value, len(self.gains)
        return value

    def _reduced_by(self, i: int, j: int, value: Any, count: int) -> Any:
        """An element of P - L L^T of all updates, of which ``count`` are subtracted already."""
        return self._subtracted(value, [g[i] * g[j] for g in self.gains[count:]], count)

    def _spread(self, m: Measurement, row: Slope) -> tuple[float, str]:
        """Largest standard deviation of h, without the noise, and when h has a larger one."""
        sizes = {j: self.intervals.size(h) for j, h in row.items()}
        endless = [self.kalman.errors[j] for j in sorted(sizes) if not math.isfinite(sizes[j])]
        limits = ", ".join(f'"{name}": 2**-8' for name in endless)
        wanted = f"a derivative by {''.join(endless[:1])} with a finite range"
        fix = "limit what h divides by or takes a root of, by ops.maximum or ops.clip; leave "
        fix += "0 out of the range of x or y of an arc tangent; or give this Measurement the "
        fix += "largest derivatives that your log or geometry reaches, as powers of two: of a "
        fix += "distance 1, of a bearing 1 / least distance in rad, 0.32 times that in ht, 57 "
        fix += f"times in deg; in rad from 256 m on slope_max={{{limits}}}"
        require(not endless, placed(m.line, "measurement"), wanted, "an infinite one", fix)
        own, name = _is_unit(row), self.kalman.errors[next(iter(row))]
        where, wanted = placed(m.line, "measurement, sd_max"), f"none, for h is the state {name}"
        fix = f"declare it as sd_max of {name}, and leave it out here"
        require(not own or m.sd_max is None, where, wanted, m.sd_max, fix)
        parts = {j: size * self.bounds[j] for j, size in sizes.items()}
        spread = math.fsum(parts.values())
        grown = [j for j in _largest(parts) if self.growth[j]]
        self.kalman.remedies[m.line] = self._less_growth(grown) if grown else ""
        if m.sd_max is None or m.sd_max >= spread:
            return spread, INDEFINITE
        return m.sd_max, CLAIMED

    def _less_growth(self, grown: Sequence[int]) -> str:
        """What input keeps the standard deviations of ``grown`` states in a prediction lower."""
        inputs = inputs_of(*(self.rows[i][j] for i in grown for j in self.growth[i]))
        sds = zip(self.kalman.errors, self.kalman.largest_sd, self.bounds, strict=True)
        texts = [f"of {name} from {sd:.3g} to {bound:.3g}" for name, sd, bound in sds]
        text = f"narrow the range of {', or '.join(sorted(inputs))} (one prediction may take the "
        text += f"standard deviation {' and '.join(texts[i] for i in grown)})"
        return text if inputs else ""

    def _within(self, value: Scalar, spread: float, unless: str) -> Any:
        """A value within a standard deviation, where its interval is wider."""
        inside = self.intervals.size(value) <= spread * (1.0 + 1e-9)
        return value if inside else _claimed(value, -spread, spread, unless=unless)

    def _move(self, s: Any) -> None:
        """The sum of all corrections of one state."""
        at = self.kalman.errors.index(self.kalman.groups[s.name][0])

        def moved_by(i: int, value: Any) -> Any:
            pairs = zip(self.gains, self.moves, strict=True)
            return self._subtracted(value, [-(g[i] * move) for g, move in pairs])

        if isinstance(s, Attitude):
            turn = [moved_by(i, 0.0) for i in range(at, at + 3)]
            q = [self.states[c] for c in s.components]
            q = corrected(q, [ops.saturated(e, 1.0) for e in turn])
            self.states |= zip(s.components, q, strict=True)
        else:
            self.states[s.name] = in_range(moved_by(at, self.states[s.name]), s)

    def _reduced(self) -> dict[str, Any]:
        """P - sum L L^T, each element once."""
        k, out = self.kalman, {}
        for name, (i, j) in k.covariance_states.items():
            self.tracer.place = k.places[i]
            value = self._reduced_by(i, j, *self.reductions.get((i, j), (self.cov[i, j], 0)))
            out[name] = self._element(value, i, j, k.largest_sd)
        return out

    # -- views ----------------------------------------------------------------------------------

    def _view(self, values: Mapping[str, Any]) -> Values:
        k, attitudes = self.kalman, {}
        for s in k.estimated:
            if isinstance(s, Attitude):
                first = k.errors.index(s.errors[0])
                q = [values[c] for c in s.components]
                self.tracer.place = s.line
                attitudes[s.name] = AttitudeView(self.tracer, q, self.slopes, first)
        self.tracer.place = ""
        named = Values("state", {**self.before, **self.memory, **values})
        covariance = {name: self.cov[pair] for name, pair in k.covariance_states.items()}
        grouped = declared.grouped([*k.scalars, *k.memory], named)
        return Values("state", {**grouped, **attitudes, **covariance})

    def _outputs(self, values: Mapping[str, Any]) -> dict[str, Any]:
        k = self.kalman
        shown = self._shown(self._view(values))
        own = {**self.decisions, **self.counts}
        results = {**own, **self.memory, **values, **shown}
        taken = ", ".join(sorted(own.keys() & {*self.memory, *values, *shown}))
        wanted = "states and results of shown with other names than what a Kalman counts"
        require(not taken, k.name, wanted, taken, "rename it")
        units = {s.name: s.unit for s in k.states if s.name not in shown}
        known = [n for n in results if n not in k.covariance_states]
        for o in k.outputs:
            where, near = placed(o.line, f"output {o.name} of {k.name}"), closest(o.name, known)
            wanted = f"a state, {', '.join(self.counts)} or key of shown, as {', '.join(near)}"
            fix = "correct the name, or return it in shown"
            require(o.name in results, where, wanted, o.name, fix)
            unit = units.get(o.name, o.unit)
            same = not (o.unit and unit) or same_unit(o.unit, unit)
            fix = "correct it, or return the converted value in shown"
            require(same, where, f"the unit of the state, {unit}", o.unit, fix)
        return {o.name: results[o.name] for o in k.outputs}

    def _shown(self, view: Values) -> dict[str, Any]:
        """What the author returns: outputs of the filter, or of a class that it is derived from."""
        k = self.kalman
        where = placed(place_of_function(k.shown), f"shown of {k.name}")
        classes = [vars(c).get("outputs", ()) for c in type(k).__mro__]
        names = dict.fromkeys(o.name for outputs in (k.outputs, *classes) for o in outputs)
        given = k.shown(view, self.u, self.p)
        return declared.spread(given, {name: (name,) for name in names}, where, "values", "output")


def _if_valid(valid: Condition | None, value: Any) -> Any:
    return value if valid is None else ops.where(valid, value, 0.0)


def _dot(row: Mapping[int, Scalar], column: Sequence[Any], first: Any = 0.0) -> Any:
    return sum((product(row[m], column[m]) for m in sorted(row)), start=first)


def _claimed(
    value: Any, low: float, high: float, reason: str = _SD, unless: str = INDEFINITE
) -> Scalar:
    """A value within bounds that hold, by default unless P is indefinite."""
    return cast(Scalar, ops.bounded(value, low, high, reason, unless=unless))


def _largest(parts: Mapping[int, float]) -> list[int]:
    return [j for j, part in sorted(parts.items()) if part >= _NAMED * max(parts.values())]


def inputs_of(*values: Any) -> set[str]:
    """Names of the inputs that recorded values read."""
    found = {v.number: v for v in values if isinstance(v, Expression)}
    queue = [*found.values()]
    for value in queue:
        queue += [arg for arg in value.args if arg.number not in found]
        found |= {arg.number: arg for arg in value.args}
    leaves = [v.data for v in found.values() if v.kind == "leaf"]
    return {name for kind, name, *_ in leaves if kind == "input"}


def _blocks(rows: Sequence[Slope]) -> list[list[int]]:
    """States in an order in which each changes before the states of its row do.

    States whose equations need each other are one block; so are states of which none needs another.
    """
    n = len(rows)
    needs = [{*row} - {i} for i, row in enumerate(rows)]
    for m in range(n):  # of what is needed, too
        needs = [needed | needs[m] if m in needed else needed for needed in needs]
    remaining, blocks = {*range(n)}, []
    while remaining:
        users = {i: {k for k in remaining if i in needs[k]} for i in remaining}
        block = [i for i in sorted(remaining) if users[i] <= needs[i]]
        blocks.append(block)
        remaining -= {*block}
    return blocks


def _is_unit(row: Slope) -> bool:
    return [is_const(h, 1.0) for h in row.values()] == [True]


def moved(kalman: Kalman, after: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """What replaces each state and memory; of an attitude the turn, by the names of its errors.

    InputError: a name that is no state's.
    """
    memory_names = [s.name for s in kalman.memory if s.name != DITHER]
    groups = kalman.groups | {name: (name,) for name in memory_names}
    groups |= declared.axes_of(memory_names)
    where = placed(place_of_function(kalman.f), f"f of {kalman.name}")
    values = declared.spread(after, groups, where, declared.NEXT)
    if kalman.dither:
        values[DITHER] = ops.wrap_ht(_FACTOR * before[DITHER] + _ADDED)
    names = (*kalman.errors, *(s.name for s in kalman.memory))
    return {name: values.get(name, before.get(name, 0.0)) for name in names}


def noise_of(
    kalman: Kalman, noise: Mapping[Any, Any], intervals: Intervals
) -> dict[tuple[int, int], Any]:
    """Variances and covariances of the process noise, by the numbers of two error states.

    InputError: an unknown name, a variance that may be negative, a covariance that is too large.
    """
    where = placed(place_of_function(kalman.noise), f"noise of {kalman.name}")
    pairs = [n for n in noise if isinstance(n, tuple)] if isinstance(noise, Mapping) else []
    single = {n: v for n, v in noise.items() if n not in pairs} if pairs else noise
    out: dict[tuple[int, int], Any] = {}
    for name, value in declared.spread(single, kalman.groups, where, "noise").items():
        low = intervals(value)[0]
        fix = "raise the least value of its parameters, or take ops.maximum(v, 0.0)"
        require(low >= 0.0, f"{where}, {name}", "a variance of 0 or more", low, fix)
        i = kalman.errors.index(name)
        out[i, i] = value
    for pair in pairs:
        i, j = sorted(kalman.errors.index(e) for e in errors_of(kalman, pair, where))
        place, fix = f"{where}, {' and '.join(pair)}", "raise the variances, or lower it"
        check_number(place, noise[pair])
        out[i, j] = noise[pair]
        low, high = intervals(noise[pair])
        most = [intervals(out.get((k, k), 0.0))[1] for k in (i, j)]
        least, largest = max(low, -high, 0.0), math.sqrt(most[0] * most[1])
        wanted = f"a covariance of at most {largest:g}, the root of both variances' product"
        require(least <= largest * (1.0 + 1e-9), place, wanted, least, fix)
    return out


def errors_of(kalman: Kalman, pair: tuple[Any, ...], where: str) -> tuple[str, ...]:
    """Two names of error states; InputError of anything else."""
    two = isinstance(pair, tuple) and len(pair) == 2 == len({*pair} & {*kalman.errors})
    wanted = f"pairs of {', '.join(kalman.errors)}"
    require(two, where, wanted, pair, "name two different states")
    return pair


def checked_measurements(kalman: Kalman, result: Any) -> list[Measurement]:
    """What ``measure`` returned; angles in half turns wrap, arc tangents in rad or degrees too.

    InputError: no measurement, something else, one whose z, h or r is no number, an error of
    `check_units`, or an angle over a full turn in another unit than half turns.
    """
    found = result if isinstance(result, tuple | list) else [result]
    where = placed(place_of_function(kalman.measure), f"measure of {kalman.name}")
    good = found is result and all(isinstance(m, Measurement) for m in found) and bool(found)
    kinds = ", ".join(type(m).__name__ for m in found)
    fix = "return one for each scalar that is measured"
    require(good, where, "a list of Measurement(z, h, r)", kinds or None, fix)
    for m in result:
        for part in ("z", "h", "r"):
            check_number(placed(m.line, f"measurement, {part}"), getattr(m, part))
        condition = m.valid is None or isinstance(m.valid, Condition | bool | np.bool_)
        where, fix = placed(m.line, "measurement, valid"), "compare it with something"
        require(condition, where, "a condition such as x > 0.5", m.valid, fix)
        declared.check_units(m)
    return [replace(m, wrap=m.wrap or _is_angle(m)) for m in map(_in_half_turns, result)]


def _in_half_turns(m: Measurement) -> Measurement:
    """A measurement whose h is an angle in rad or degrees, computed by an arc tangent, in ht."""
    h = m.h
    if not (isinstance(h, Scalar) and h.kind == "mul" and ops.unit_of(h)[0]):
        return m
    turn = h.args[1].data[0]
    sd_max = None if m.sd_max is None else m.sd_max / turn
    # Up to the next power of two.
    slope_max = {n: 2.0 ** declared.exponent(most / turn) for n, most in m.slope_max.items()}
    z, r = m.z * (1.0 / turn), m.r * (1.0 / turn**2)
    largest = {"sd_max": sd_max, "slope_max": slope_max, "turn": turn}
    return replace(m, z=z, h=h.args[0], r=r, wrap=True, **largest)


def _is_angle(m: Measurement) -> bool:
    """Whether z or h is an angle in half turns; InputError of another one over a full turn."""
    units = [ops.unit_of(value) for value in (m.z, m.h)]
    fix = 'declare input and state as ("NAME", -1.0, 1.0, "ht"), whose log columns are converted; '
    fix += "convert what f, noise and measure compute with: rates / pi, variances / pi^2"
    for unit, span in units:
        _, turn = ops.ANGLES.get(unit, ("", 0.0))
        full = 0.99 * turn < span < 1.05 * turn
        wanted = f"angles over a full turn of {span:g} {unit} in half turns, which wrap"
        require(not full, placed(m.line, "measurement"), wanted, unit, fix)
    return any(unit == "ht" for unit, _ in units)


def turned(q: Sequence[Any], turn: Sequence[Any]) -> list[Any]:
    """Q dq of a turn [rad, body axes] of components up to half a radian."""
    half = [ops.saturated(0.5 * t, 0.25) for t in turn]
    after = quaternion.multiply(list(q), quaternion.increment(half))
    return [ops.bounded(c, -1.0, 1.0, "unit quaternion") for c in after]


def corrected(q: Sequence[Any], e: Sequence[Any]) -> list[Any]:
    """(1, e/2) q of norm one: q turned by e [rad, navigation axes], each component at most 1."""
    half = [ops.saturated(0.5 * c, 0.5) for c in e]
    moved = quaternion.vector_times(half, q)
    raw = [ops.saturated(a + b, 2.0) for a, b in zip(q, moved, strict=True)]
    norm_sq = ops.bounded(quaternion.dot(raw, raw), 0.25, 2.0, "a quaternion near norm one")
    scale = ops.rsqrt(norm_sq)
    return [ops.saturated(c * scale, 1.0) for c in raw]


def in_range(value: Any, s: Any) -> Any:
    """A next value of a state in its range."""
    if s.unit == "ht":
        return value if isinstance(value, Scalar) and value.kind == "wrap" else ops.wrap_ht(value)
    reason = "model or measurement take it beyond; then its word saturates"
    return ops.bounded(value, s.low, s.high, "range of the state", unless=reason)


def measurements_of(kalman: Kalman, x: Any, u: Any, p: Any) -> list[Measurement]:
    """What ``measure`` returns of predicted states ``x``; z and h of a late one are those of then.

    Of several of one line each has its number there. InputError: as of `checked_measurements`; a
    delay without a known time step.
    """
    found = checked_measurements(kalman, kalman.measure(x, u, p))
    lines = [m.line for m in found]
    for n, line in enumerate(lines):
        if lines.count(line) > 1:
            found[n] = replace(found[n], line=f"{line}, no. {lines[: n + 1].count(line)}")
    for delay in sorted({m.delay for m in found} - {0.0}):
        line = next(m.line for m in found if m.delay == delay)
        earlier = _earlier(kalman, x, u, p, delay, line)
        late = checked_measurements(kalman, kalman.measure(earlier, u, p))
        pairs = zip(found, late, strict=True)
        found = [replace(m, z=m2.z, h=m2.h) if m.delay == delay else m for m, m2 in pairs]
    return found


def _earlier(kalman: Kalman, x: Any, u: Any, p: Any, delay: float, line: str) -> Values:
    """States ``delay`` seconds ago; attitudes and memory are those of now.

    f with dt = -delay, if dt is an input. Otherwise by the middle of the interval, with the rate
    of change x'(x) = (f(x) - x) / dt, which is that of half a step later::

        x(t - d) = x - d x'(x - (d + dt)/2 x'(x))
    """
    scalars = kalman.scalars
    now = {s.name: getattr(x, s.name) for s in scalars}

    def moved_by(values: dict[str, Any], inputs: Any) -> dict[str, Any]:
        after = kalman.f(_seen(kalman, x, values), inputs, p)
        return moved(kalman, after, {**vars(x), **values})

    def ago(values: dict[str, Any], seconds: float) -> dict[str, Any]:
        after, steps = moved_by(values, u), seconds * rate
        out = {}
        for s in scalars:
            change = _without(after[s.name], values[s.name])
            change = after[s.name] - values[s.name] if change is None else change
            change = ops.wrap_ht(change) if s.unit == "ht" else change
            out[s.name] = in_range(now[s.name] - steps * change, s)
        return out

    if dt := next((i for i in kalman.inputs if i.name == "dt"), None):
        steps = delay * linear("s", dt.unit)[0] if dt.unit else delay
        after = moved_by(now, Values("input", {**vars(u), "dt": -steps}))
        return _seen(kalman, x, {s.name: in_range(after[s.name], s) for s in scalars})
    rate = kalman.rates_hz.get("dt", 0.0)
    fix = 'declare rates_hz = {"dt": 1.0 / DT} in the class, or an input dt'
    where = placed(line, "measurement, delay")
    require(rate > 0.0, where, "the time step of the model", None, fix)
    return _seen(kalman, x, ago(ago(now, 0.5 * (delay + 1.0 / rate)), delay))


def _seen(kalman: Kalman, x: Any, values: dict[str, Any]) -> Values:
    """The view ``x`` with other values of the scalar states."""
    return Values("state", {**vars(x), **declared.grouped(kalman.scalars, Values("state", values))})


def _without(total: Any, term: Any) -> Any:
    """A sum without one of its terms, narrower than the difference; None if it is not one."""
    if total is term:
        return 0.0
    if isinstance(total, Scalar) and total.kind in ("add", "sub"):
        a, b = total.args
        if (rest := _without(a, term)) is not None:
            return rest + b if total.kind == "add" else rest - b
        if total.kind == "add" and (rest := _without(b, term)) is not None:
            return a + rest
    return None
