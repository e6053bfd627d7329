"""The verdict on accuracy: differences, clamps and saturations, and what went wrong first."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from boresight.firmware.build import CModel, WordRanges
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import ATTITUDE, QUATERNION
from boresight.model.kalman.update import CLAIMED
from boresight.model.lowering.graph import declared_name
from boresight.model.lowering.profile import Range
from boresight.model.words.fixed import IntArray
from boresight.sim.compare import diagnosis
from boresight.sim.compare.diagnosis import Wasted
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.compare.textbook import decisions_apart, with_outputs
from boresight.sim.compare.twin import Traced, made_of, outside
from boresight.sim.levels.build import Build, Level, Run, words_of
from boresight.sim.levels.registry import CompiledFloat, Emitted
from boresight.sim.ranges.claims import Claim, claims_of
from boresight.sim.result import plain

#: Records (n, n_inputs), states after each, and whether it begins from the initial ones.
Piece = tuple[FloatArray, IntArray, BoolArray]
MOST_SATURATED = 5  #: Saturated values that a line names, the most frequent first.
_KEPT_STEPS = [1 << k for k in range(40)]  #: whose outputs of float64 are kept, behind the first.
_ENDLESS = 2.0**20  #: Multiple of an output's format from which on float64 diverges.
#: Cure of an estimator that diverges in float64.
_CORRECT = "correct the equations, the parameters or the log"


@dataclass(frozen=True)
class Accuracy:
    """How near fixed point is to float64, and whether that is what the author accepts."""

    differences: tuple[Difference, ...]  #: of each output, in its unit.
    saturated_updates: int  #: in which an operation was clamped.
    #: Updates by the name of the value that was clamped, with its line; of several with one name,
    #: those of the one that was clamped most often.
    saturated: dict[str, int]
    #: States and claims of `ops.bounded` that left their ranges though their words hold them: what
    #: was sized by the range does not.
    beyond_range: tuple[str, ...]
    clamped: dict[str, int]  #: samples beyond the range of inputs that are declared to be clamped.
    culprit: str  #: the first value that left its float twin, where something is wrong; else empty.
    wasted: tuple[Wasted, ...] = ()  #: values that waste most bits.
    #: Extremes of the value of each of `claims_of`; None of one that no word holds.
    reached: tuple[tuple[float, float] | None, ...] = ()
    broken: frozenset[int] = frozenset()  #: claims that a value broke; indices.
    ranges: WordRanges | None = None  #: extremes of every value; None of floating point.
    near_floor: str = ""  #: the root or reciprocal that is near its floor.
    diverges: str = ""  #: the output of float64 that is no number, or beyond all ranges.
    #: Outputs of float64 in the steps 0, 1, 2, 4, 8 ..., by their names: for a baseline.
    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def good(self) -> bool:
        """Every output within its tolerance, nothing saturated, no state beyond its range."""
        clean = not self.saturated_updates and not self.beyond_range and not self.diverges
        return clean and all(d.good for d in self.differences)

    def to_json(self) -> dict[str, Any]:
        return {
            "good": self.good,
            "outputs": [
                {**d.to_json(), "float64": plain(self.values.get(d.output, {}))}
                if d.tolerance
                else d.to_json()
                for d in self.differences
            ],
            "saturated_updates": self.saturated_updates,
            "saturated": self.saturated,
            "beyond_range": list(self.beyond_range),
            "clamped_inputs": self.clamped,
            "diverges": self.diverges,
            "culprit": self.culprit,
            "wasted": [vars(w) for w in self.wasted],
        }

    def faults(self) -> list[str]:
        """What is wrong, one line each; empty if `good`."""
        differences = [d.line() for d in self.differences if not d.good]
        return [self.diverges, *differences, *self.causes()][not self.diverges :]

    def causes(self) -> list[str]:
        """`faults` without the differences: saturations, ranges, the first failing operation."""
        n = self.saturated_updates
        clamped = [saturated_text(n, self.saturated)] if n else []
        first = [f"first wrong: {self.culprit}"] if self.culprit else []
        return [*clamped, *self.beyond_range, *first]

    def lines(self) -> list[str]:
        out = [f"fixed against float64: {d.line()}" for d in self.differences]
        out += [self.diverges] if self.diverges else []
        if self.clamped:
            names = ", ".join(f"{name} ({n})" for name, n in self.clamped.items())
            out.append(f"inputs clamped, as declared: {names}")
        return out + self.causes()


def saturated_text(updates: int, values: Mapping[str, int]) -> str:
    """How many updates saturated, and updates by the name of the value, the most frequent first."""
    most = sorted(values.items(), key=lambda item: -item[1])
    names = ", ".join(f"{name} ({n})" for name, n in most[:MOST_SATURATED])
    if len(most) > MOST_SATURATED:
        names += f", and {len(most) - MOST_SATURATED} more values"
    return f"{updates} updates SATURATED{': ' * bool(names)}{names}"


def saturations(
    level: Level,
    pieces: Iterable[tuple[FloatArray, bool]],
    params: Mapping[str, float] | None = None,
) -> dict[str, int]:
    """Updates by the name of the value that saturated, as `Accuracy.saturated`.

    The level's build is run again in C on ``pieces``: records (n, n_inputs) in their units, and
    whether they begin from the initial states; with ``params`` if they are not those of the build.
    """
    of = Traced.of(level.build, level.number)
    counts = np.zeros(len(of.program.values), dtype=np.int64)
    again = Emitted(level.build, level.number)
    if params is not None:
        again.set_params(params)
    for records, anew in pieces:
        if anew:
            again.reset()
        counts += again.observe(records).saturations
    return _by_name(of, counts)


def judge(
    build: Build,
    number: int,
    records: FloatArray,
    run: Run,
    reference: Run,
    clamped: Mapping[str, int],
) -> Accuracy:
    """Judge a run on ``records`` (n, n_inputs), of a log or a closed loop; see `Judge`."""
    judging = Judge(build, number)
    states = judging.add(records, run, reference)
    anew = np.zeros(len(records), dtype=np.bool_)
    return judging.result(clamped, lambda: [(records, states, anew)])


class Judge:
    """How near a run of a build's estimator is to float64, piece by piece from a reset on."""

    def __init__(self, build: Build, number: int) -> None:
        self._build, self._number = build, number
        self._of = Traced.of(build, number)
        self._program = self._of.program
        self._claims = claims_of(self._of)
        outputs = self._of.estimator.outputs
        self._errors = Differences(outputs, [o.name for o in outputs])
        self._values: dict[str, dict[str, float]] = {o.name: {} for o in outputs}
        self._rows = self._saturated = 0
        #: First update in which an operation saturated, and in which an output of float64 is no
        #: number or beyond all ranges, with its name and value.
        self._clamp: int | None = None
        self._endless: tuple[int, str, float] | None = None
        #: By number of a state: first update after which it is out of its range, and its value.
        self._left: dict[int, tuple[int, float]] = {}
        #: The same of variances below 0.
        self._negative: dict[int, tuple[int, float]] = {}
        self._variances = diagnosis.variances_of(self._of.estimator)
        #: Extremes of every value, and the largest change of each state.
        self._ranges: WordRanges | None = None
        self._last: IntArray | None = None
        self._changes = np.zeros(len(self._program.states), dtype=np.int64)
        self._models: list[CModel] = []

    def add(self, records: FloatArray, run: Run, reference: Run, *, anew: bool = False) -> IntArray:
        """Take the next rows; return the states (n, n_states), none in floating point.

        ``run`` is of any level; in floating point nothing saturates, and only differences from
        float64, the ``reference``, are judged. The C supplies states that a level does not show.
        ``anew``: the rows begin from the initial states.
        """
        self._errors.add(run.outputs, reference.outputs)
        start, self._rows = self._rows, self._rows + len(records)
        for step in (k for k in (0, *_KEPT_STEPS) if start <= k < self._rows):
            kept = {name: float(reference.outputs[name][step - start]) for name in self._values}
            if kept.keys() >= {*QUATERNION}:  # q and -q are one attitude
                sign = math.copysign(1.0, max((kept[n] for n in QUATERNION), key=abs))
                kept |= {n: sign * kept[n] for n in QUATERNION}
            for name, value in kept.items():
                self._values[name][f"step {step}"] = value
        if run.words is None or not len(records):
            return np.zeros((len(records), 0), dtype=np.int64)
        self._models = self._models or [CModel(self._program), CModel(self._program)]
        for model in self._models if anew else ():
            model.reset()
        words, self._last = words_of(self._program, records), None if anew else self._last
        states = self._models[0].trajectory(words)[2] if run.states is None else run.states
        seen = self._models[1].observe(words)
        self._ranges = self._ranges.followed(start, seen) if self._ranges else seen
        rows = states if self._last is None else np.concatenate([self._last[None], states])
        changes = np.abs(np.diff(rows, axis=0)).max(axis=0, initial=0)
        self._changes, self._last = np.maximum(self._changes, changes), states[-1]
        self._saturated += run.n_saturated
        if self._clamp is None and run.saturated is not None and run.saturated.any():
            self._clamp = start + int(np.argmax(run.saturated))
        if self._endless is None:
            self._endless = self._diverging(start, reference)
        for k, (state, _) in enumerate(self._program.states):
            reals = self._program.format(state).real(states[:, k])
            left = outside(reals, self._program.values[state])
            negative = (reals < 0.0) & (k in self._variances)
            for first, rows in ((self._left, left), (self._negative, negative)):
                if k not in first and rows.any():
                    step = int(np.argmax(rows))
                    first[k] = start + step, float(reals[step])
        return states

    def _diverging(self, start: int, reference: Run) -> tuple[int, str, float] | None:
        """The first output of float64 that is no number or beyond all ranges, if there is one."""
        program, first = self._program, list[tuple[int, str, float]]()
        for name, value in zip(program.output_names, program.outputs, strict=True):
            values = reference.outputs[name]
            wrong = ~(np.abs(values) <= _ENDLESS * -program.format(value).min)
            if wrong.any():
                row = int(np.argmax(wrong))
                first.append((start + row, name, float(values[row])))
        return min(first, default=None)

    def result(self, clamped: Mapping[str, int], again: Callable[[], Iterable[Piece]]) -> Accuracy:
        """The verdict; ``again`` gives the pieces once more, to look for what went wrong."""
        errors, clamped = tuple(self._errors.result()), dict(clamped)
        if self._ranges is None:
            return Accuracy(errors, 0, {}, (), clamped, "", values=self._values)
        program, claims = self._program, self._claims
        saturated = [*map(int, np.flatnonzero(self._ranges.saturations))]
        reached = diagnosis.reached_by(program, self._ranges)
        left = {program.values[program.states[k][0]].name for k in self._left}
        extremes = [None if c.word is None else reached[c.word] for c in claims]
        broken = {
            k
            for k, (claim, seen) in enumerate(zip(claims, extremes, strict=True))
            if claim.state in left
            or (
                claim.bounded
                and claim.unless in ("", CLAIMED)
                and seen is not None
                and claim.broken_by(seen)
            )
        }
        near = diagnosis.near_floor(self._of, self._ranges, reached)
        bad = saturated or broken or left or not all(d.good for d in errors)
        if self._of.estimator.sizes and (bad or near):
            rows = ((records, bool(anew[0])) for records, _, anew in again() if len(anew))
            needs = diagnosis.needs_of(self._of, self._build.params[self._number], rows)
            self._of = replace(self._of, needs=needs)
            near = diagnosis.near_floor(self._of, self._ranges, reached)
        wasted = diagnosis.wasted_bits(self._of, reached)
        diverges = ""
        if self._endless is not None:
            step, name, value = self._endless
            diverges = f"float64 diverges: {name} is {value:.3g} in step {step}; {_CORRECT}"
        return Accuracy(
            errors,
            self._saturated,
            _by_name(self._of, self._ranges.saturations),
            self._beyond(saturated, [claims[k] for k in sorted(broken)], reached, again),
            clamped,
            self._culprit(errors, saturated, wasted, reached, again),
            tuple(wasted[: diagnosis.NAMED]),
            tuple(extremes),
            frozenset(broken),
            self._ranges,
            near,
            diverges,
            self._values,
        )

    def _beyond(
        self,
        saturated: Sequence[int],
        broken: Sequence[Claim],
        reached: Mapping[int, Range],
        again: Callable[[], Iterable[Piece]],
    ) -> tuple[str, ...]:
        """A line for each state and claim beyond its range; saturations are named already."""
        assert self._ranges is not None
        program, nodes, lines = self._program, self._of.nodes, list[str]()
        negative = sorted(self._negative.items(), key=lambda x: x[1][0])
        for k, (step, value) in negative[:1] if self._endless is None else ():
            name = declared_name(program, nodes, program.states[k][0])
            exact = self._least(name, again())
            lines.append(
                f"the variance {name} is {value:.3g} in step {step}, below 0, "
                f"{diagnosis.positive_text(self._of, exact)}"
            )
        named = {self._of.becomes(n) for n in saturated}
        diverges = "" if self._endless is None else "float64 diverges"
        for k, (step, value) in sorted(self._left.items()):
            state = program.states[k][0]
            said, name = program.values[state], declared_name(program, nodes, state)
            if state not in named and k not in self._negative:
                lines.append(
                    f"state {name} is {value:.6g} in step {step}, BEYOND its declared range "
                    f"[{said.low:g}, {said.high:g}]: {diverges or 'widen it'}"
                )
        steps = self._ranges.low_at, self._ranges.high_at
        for claim in broken:
            if claim.state or claim.word is None or claim.word in saturated:
                continue
            ends = reached[claim.word]
            end = int(ends[1] - claim.high > claim.low - ends[0])
            where = f"{claim.line}: " if claim.line else ""
            cure = diverges or "widen it, or limit the value"
            cure = diagnosis.raise_text(self._of, claim.line) if claim.unless == CLAIMED else cure
            lines.append(
                f"{where}{ends[end]:.6g} in step {int(steps[end][claim.word])} is BEYOND the "
                f"stated range [{claim.low:g}, {claim.high:g}], {claim.reason}: {cure}"
            )
        return tuple(lines)

    def _least(self, name: str, pieces: Iterable[Piece]) -> float:
        """The least value of a state in float64."""
        other = with_outputs(
            self._of.estimator,
            lambda trace: {name: next(e for s, _, e in trace.states if s.data[1] == name)},
        )
        level, least = CompiledFloat(Build(other, params=[self._build.params[self._number]])), []
        for records, _, anew in pieces:
            if len(anew) and anew[0]:
                level.reset()
            least.append(level.run(records).outputs[name].min(initial=math.inf))
        return min(least, default=math.inf)

    def _culprit(
        self,
        errors: Sequence[Difference],
        saturated: Collection[int],
        wasted: Sequence[Wasted],
        reached: Mapping[int, Range],
        again: Callable[[], Iterable[Piece]],
    ) -> str:
        """The first operation that leaves its float twin, or what to do about rounding."""
        program = self._program
        bad = {d.output for d in errors if not d.good}
        by_hand = not self._of.estimator.covariance_elements
        negative = by_hand and self._negative and self._endless is None
        if not (bad or self._left or self._saturated) or negative:
            return ""  # a negative variance has its own line
        steps = {step for step, _ in self._left.values()}
        steps |= {d.first_beyond for d in errors if d.first_beyond is not None}
        steps |= set() if self._clamp is None else {self._clamp}
        # Values of outputs that are accepted are not to blame.
        faults = {*saturated, *(program.states[k][0] for k in self._left)}
        bad |= {*QUATERNION} if ATTITUDE in bad else set()
        outputs = zip(program.output_names, program.outputs, strict=True)
        faults |= {n for name, n in outputs if name in bad}
        pieces = ((words_of(program, rows), states, anew) for rows, states, anew in again())
        first = diagnosis.find_culprit(self._of, pieces, sorted(steps), made_of(program, faults))
        rows = ((records, anew) for records, _, anew in again())
        decides = bad and (first is None or self._of.estimator.sizes)  # or a value is to blame
        apart = decisions_apart(self._build, self._number, rows) if decides else None
        if self._endless is not None:
            widen = first is not None and first.cure.startswith(diagnosis.WIDEN)
            first = first._replace(cure=_CORRECT) if first is not None and widen else first
            text = str(first or "")
        else:
            text = str(first or diagnosis.rounding_text(self._of, wasted, self._changes, reached))
        if apart is not None and apart[0] <= (first.step if first else max(steps)):
            text = apart[1]
        return text


def _by_name(of: Traced, counts: IntArray) -> dict[str, int]:
    """Counts of values by name and line; of several with one name, the largest."""
    names: dict[str, int] = {}
    for n in map(int, np.flatnonzero(counts)):
        name = of.place(n)
        names[name] = max(int(counts[n]), names.get(name, 0))
    return names
