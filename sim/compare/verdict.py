"""The verdict on accuracy: differences, clamps and saturations, and what went wrong first."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.firmware.build import CModel, WordRanges
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import ATTITUDE, QUATERNION
from boresight.model.lowering.graph import LEAVES, Node, declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.compare.culprit import find_culprit
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.compare.influence import UPDATES, influences
from boresight.sim.compare.twin import authors_name, becomes, made_of, outside
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import Run

__all__ = ["Accuracy", "Judge", "Traversed", "judge"]


#: Values that saturated of which a line names, those first that did most often.
_FEW = 5


@dataclass(frozen=True)
class Accuracy:
    """How near fixed point is to float64, and whether that is what the author accepts.

    Attributes
    ----------
    differences : tuple of Difference
        Of each output, in its unit.
    saturated_updates : int
        Updates in which an operation was clamped.
    saturated : dict of str to int
        Updates by the name of the value that was clamped, with its line; of several with one name,
        those of the one that was clamped most often.
    beyond_range : tuple of str
        States that left their declared ranges though their words hold them: what was sized by the
        range does not.
    clamped : dict of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    culprit : str
        The first value that left its float twin, where something is wrong; else empty.
    """

    differences: tuple[Difference, ...]
    saturated_updates: int
    saturated: dict[str, int]
    beyond_range: tuple[str, ...]
    clamped: dict[str, int]
    culprit: str

    @property
    def good(self) -> bool:
        """Every output within its tolerance, nothing saturated, no state beyond its range."""
        clean = not self.saturated_updates and not self.beyond_range
        return clean and all(d.good for d in self.differences)

    def largest(self, output: str) -> float | None:
        """Largest difference of an output; None if it was not compared."""
        return next((d.largest for d in self.differences if d.output == output), None)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "good": self.good,
            "outputs": [d.to_json() for d in self.differences],
            "saturated_updates": self.saturated_updates,
            "saturated": self.saturated,
            "beyond_range": list(self.beyond_range),
            "clamped_inputs": self.clamped,
            "culprit": self.culprit,
            "source": "fixed against float64 (compiled), every sample, in the output's unit",
        }

    def faults(self) -> list[str]:
        """What is wrong, one line each; empty if `good`."""
        return [d.line() for d in self.differences if not d.good] + self.causes()

    def causes(self) -> list[str]:
        """`faults` without the differences: saturations, ranges, the first failing operation."""
        out = []
        if self.saturated_updates:
            most = sorted(self.saturated.items(), key=lambda item: -item[1])
            names = ", ".join(f"{name} ({n})" for name, n in most[:_FEW])
            if len(most) > _FEW:
                names += f", and {len(most) - _FEW} more values"
            out.append(f"{self.saturated_updates} updates SATURATED: {names}")
        return [
            *out,
            *self.beyond_range,
            *([f"first wrong: {self.culprit}"] if self.culprit else []),
        ]

    def lines(self) -> list[str]:
        """Everything, for people."""
        out = [f"fixed against float64: {d.line()}" for d in self.differences]
        if self.clamped:
            names = ", ".join(f"{name} ({n})" for name, n in self.clamped.items())
            out.append(f"inputs clamped, as declared: {names}")
        return out + self.causes()


def judge(
    build: Build,
    number: int,
    records: FloatArray,
    run: Run,
    reference: Run,
    clamped: Mapping[str, int],
) -> Accuracy:
    """Judge a run of one of a build's estimators, of a log or a closed loop; see `Judge`.

    Parameters
    ----------
    records : float64 (n, n_inputs)
        Inputs that it was run on, from a reset on.
    """
    judging = Judge(build, number, curves=True)
    states = judging.add(records, run, reference)
    return judging.result(clamped, lambda: [(records, states)])


class Judge:
    """How near a run of one of a build's estimators is to float64, piece by piece from a reset on.

    Parameters
    ----------
    curves : bool
        Whether `Difference.apart` is kept.
    """

    def __init__(self, build: Build, number: int, *, curves: bool = False) -> None:
        self._estimator, self._program = build.estimators[number], build.programs[number]
        self._nodes = build.nodes[number]
        #: Other programs update its states, too: updates do not follow from those before.
        self._shared = number in build.sharing
        names = [o.name for o in self._estimator.outputs]
        self._errors = Differences(self._estimator.outputs, names, curves=curves)
        self._rows = self._saturated = 0
        #: First updates: in which one saturated, in which float64 is none, with a state outside.
        self._clamp: int | None = None
        self._endless: int | None = None
        self._left: dict[int, tuple[int, float]] = {}
        self._model: CModel | None = None
        self._words = False

    def add(self, records: FloatArray, run: Run, reference: Run) -> IntArray:
        """The next rows; return the states (n, n_states), which are none in floating point.

        Parameters
        ----------
        records : float64 (n, n_inputs)
            Inputs in their units.
        run : Run
            Of any level; in floating point nothing saturates, and only differences are judged.
            States that a level does not show are those of the C.
        reference : Run
            That of float64.
        """
        self._errors.add(run.outputs, reference.outputs)
        start, self._rows = self._rows, self._rows + len(records)
        self._words = run.words is not None
        if not self._words:
            return np.zeros((len(records), 0), dtype=np.int64)
        if (states := run.states) is None:
            self._model = self._model or CModel(self._program)
            states = self._model.trajectory(words_of(self._program, records))[2]
        self._saturated += run.n_saturated
        if run.saturated is not None:
            self._clamp = _first(self._clamp, start, run.saturated)
        for values in reference.outputs.values():
            self._endless = _first(self._endless, start, ~np.isfinite(values))
        for k, (state, _) in enumerate(self._program.states):
            if k not in self._left:
                reals = self._program.format(state).real(states[:, k])
                wrong = outside(reals, self._program.values[state])
                if wrong.any():
                    step = int(np.argmax(wrong))
                    self._left[k] = start + step, float(reals[step])
        return states

    def result(
        self, clamped: Mapping[str, int], again: Callable[[], Iterable[tuple[FloatArray, IntArray]]]
    ) -> Accuracy:
        """The verdict.

        Parameters
        ----------
        clamped : mapping of str to int
            Samples beyond the range of inputs that are declared to be clamped.
        again : callable
            The pieces of records with their states once more, to look for what went wrong.
        """
        errors, clamped = tuple(self._errors.result()), dict(clamped)
        clean = not self._saturated and not self._left and all(d.good for d in errors)
        if clean or not self._words:
            return Accuracy(errors, 0, {}, (), clamped, "")
        program, nodes = self._program, self._nodes
        if self._shared:
            beyond = tuple(
                f"state {declared_name(program, nodes, program.states[k][0])} is {reached:.6g} in "
                f"step {step}, BEYOND its declared range"
                for k, (step, reached) in sorted(self._left.items())
            )
            clamp = "" if self._clamp is None else f"the first to saturate is step {self._clamp}; "
            text = f"{clamp}causes are not sought where states are shared"
            return Accuracy(errors, self._saturated, {}, beyond, clamped, text)
        steps = {step for step, _ in self._left.values()}
        steps |= {d.first_beyond for d in errors if d.first_beyond is not None}
        steps |= set() if self._clamp is None else {self._clamp}
        pieces = ((words_of(program, records), states) for records, states in again())
        seen = Traversed(program, pieces)
        saturated = {n: int(k) for n, k in enumerate(seen.ranges.saturations) if k}
        # Values of outputs that are accepted are not to blame.
        faults = {*saturated, *(program.states[k][0] for k in self._left)}
        bad = {d.output for d in errors if not d.good}
        bad |= {*QUATERNION} if ATTITUDE in bad else set()
        outputs = zip(program.output_names, program.outputs, strict=True)
        faults |= {n for name, n in outputs if name in bad}
        pieces = ((words_of(program, records), states) for records, states in again())
        first = find_culprit(program, nodes, pieces, sorted(steps), made_of(program, faults))
        culprit = str(first) if first else _rounding(program, nodes, seen, errors)
        if self._endless is not None:
            culprit = (
                f"float64 is no number from step {self._endless} on: the estimator diverges; "
                f"{culprit}"
            )
        names: dict[str, int] = {}
        for n, count in saturated.items():
            name = _named(program, nodes, n)
            names[name] = max(count, names.get(name, 0))
        named = {becomes(program, nodes, n) for n in saturated}  # what saturates is said already
        left = [(program.states[k][0], *self._left[k]) for k in sorted(self._left)]
        texts = tuple(
            f"state {declared_name(program, nodes, n)} is {reached:.6g} in step {step}, BEYOND its "
            f"declared range [{program.values[n].low:g}, {program.values[n].high:g}]: widen it"
            for n, step, reached in left
            if n not in named
        )
        return Accuracy(errors, self._saturated, names, texts, clamped, culprit)


def _first(before: int | None, start: int, rows: BoolArray) -> int | None:
    """First row of all; ``before``: that of the pieces before, None for none."""
    return start + int(np.argmax(rows)) if before is None and rows.any() else before


class Traversed:
    """What all updates did, piece by piece: extremes, changes of states, the last ones.

    Parameters
    ----------
    pieces : iterable of (int64 (n, n_inputs), int64 (n, n_states))
        Input words, and the states after each update; from a reset on.

    Attributes
    ----------
    ranges : WordRanges
        Extremes of every value; states count with the words before each update.
    count : int
        Updates.
    changes : int64 (n_states,)
        Largest change of each state.
    inputs, states, before
        Of the last `UPDATES`, and the states before them.
    """

    def __init__(self, program: Program, pieces: Iterable[tuple[IntArray, IntArray]]) -> None:
        model, count = CModel(program), 0
        ranges: WordRanges | None = None
        self.inputs = np.zeros((0, len(program.inputs)), dtype=np.int64)
        self.states = np.zeros((0, len(program.states)), dtype=np.int64)
        self.before: IntArray | None = None
        self.changes = np.zeros(len(program.states), dtype=np.int64)
        for inputs, states in pieces:
            seen = model.observe(inputs)
            ranges, count = ranges.followed(count, seen) if ranges else seen, count + len(inputs)
            self.inputs = np.concatenate([self.inputs, inputs])
            self.states = np.concatenate([self.states, states])
            new = self.states[-len(states) - 1 :]  # and the state before them
            changes = np.abs(np.diff(new, axis=0)).max(axis=0, initial=0)
            self.changes = np.maximum(self.changes, changes)
            if (spare := len(self.inputs) - UPDATES) > 0:
                self.before = self.states[spare - 1]
                self.inputs, self.states = self.inputs[spare:], self.states[spare:]
        assert ranges is not None  # there is an update
        self.ranges, self.count = ranges, count


def _named(program: Program, nodes: dict[int, Node], value: int) -> str:
    name = authors_name(program, nodes, value)
    line = nodes[value].line if value in nodes and becomes(program, nodes, value) is None else ""
    return name + (f", {line}" if line else "")


#: Share of a difference's root mean square that independent rounding has to explain.
_EXPLAINED = 0.125
#: Values that are named as its sources.
_NAMED = 3


def _rounding(
    program: Program, nodes: dict[int, Node], seen: Traversed, errors: Sequence[Difference]
) -> str:
    """What to do where no single operation is to blame: rounding adds up.

    The values whose rounding makes most of an output's error, where that explains it; else rounding
    is one-sided: of the value on whose rounding an output depends most, where its format has bits
    to spare, such as an element of a covariance between two measurements, or of a state that loses
    it (`_coarse`).
    """
    rounding = "no operation leaves its float twin: rounding adds up"
    effects = influences(program, nodes, seen.inputs, seen.states, seen.before)
    for d in errors:
        own = effects.get(d.output, [])
        explained = math.sqrt(math.fsum(i.rms**2 for i in own))
        if not d.good and explained > _EXPLAINED * d.rms:
            shares = ", ".join(
                f"{i.share:.0%} from {_said(program, nodes, program.find(i.value))}"
                for i in own[:_NAMED]
                if i.share > 0.01
            )
            cure = _cure(program, nodes, seen.ranges, program.find(own[0].value))
            left = own[0].one_more_bit / explained
            return (
                f"{rounding}; of the error of {d.output} {shares}; one more bit of the first "
                f"leaves {left:.0%}: {cure}"
            )
    for d in errors:
        if d.good or not (own := effects.get(d.output, [])):
            continue
        value = program.find(own[0].value)
        if becomes(program, nodes, value) is None and _unused(program, seen.ranges, value) > 1:
            return (
                f"{rounding}, to one side; {d.output} depends most on the rounding of "
                f"{_said(program, nodes, value)}: {_cure(program, nodes, seen.ranges, value)}"
            )
    return _coarse(program, nodes, seen, rounding)


def _unused(program: Program, seen: WordRanges, value: int) -> int:
    """Bits of a word that no update used."""
    used = max(int(seen.high[value]), -int(seen.low[value]))
    return program.arithmetic.word - 1 - used.bit_length()


def _said(program: Program, nodes: dict[int, Node], value: int) -> str:
    """A value, or the state that it becomes, with its line."""
    name, line = authors_name(program, nodes, value), nodes[value].line
    return f"{name} ({line})" if line else name


def _cure(program: Program, nodes: dict[int, Node], seen: WordRanges, value: int) -> str:
    """How a value gets more bits."""
    unused = _unused(program, seen, value)
    state = becomes(program, nodes, value)
    if state is not None:
        said = program.values[state]
        spare = f"[{said.low:g}, {said.high:g}], which leaves {unused} bits unused"
        narrow = f"narrow its range {spare}, " if unused > 1 else ""
        return f"{narrow}use a wider word, or carry the remainder in a second state"
    if unused <= 1:
        return "use a wider word"
    if not any(node.fit is not None for node in nodes.values()):
        return (
            f"it leaves {unused} bits unused: get formats by boresight fit; where these do not "
            "help, narrow inputs and states (boresight fit --propose), use ops.bounded, or a wider "
            "word"
        )
    if (node := nodes[value]).kind == "bounded":
        return (
            f"it leaves {unused} bits unused with the profile, too: narrow the range "
            f"[{node.low:g}, {node.high:g}] that ops.bounded states there, or use a wider word"
        )
    return (
        f"it leaves {unused} bits unused with the profile, too: limit what it is computed from "
        "with ops.bounded (elements of a covariance after each measurement, by standard "
        "deviations), narrow inputs and states (boresight fit --propose), or use a wider word"
    )


def _coarse(program: Program, nodes: dict[int, Node], seen: Traversed, rounding: str) -> str:
    """The state whose changes have the fewest bits: every update rounds it, perhaps to one side."""
    if not program.states:
        return f"{rounding}; use a wider word"
    changes = seen.changes
    computed = [k for k, (_, after) in enumerate(program.states) if _is_computed(nodes, after)]
    k = min(computed or [0], key=lambda k: int(changes[k]))
    state, after = program.states[k]
    value, line = program.values[state], nodes[after].line if after in nodes else ""
    name = declared_name(program, nodes, state)
    unused = _unused(program, seen.ranges, state)
    return (
        f"{rounding}; state {name}{f' ({line})' if line else ''} changes by no more than "
        f"{int(changes[k])} of its least significant bits in an update and leaves {unused} bits of "
        f"its range [{value.low:g}, {value.high:g}] unused: "
        + ("narrow that range, " if unused > 1 else "")
        + "use a wider word, or carry the remainder in a second state"
    )


def _is_computed(nodes: dict[int, Node], value: int) -> bool:
    """Whether arithmetic makes a value: it is no leaf, and no copy of one."""
    return value in nodes and nodes[value].kind not in LEAVES
