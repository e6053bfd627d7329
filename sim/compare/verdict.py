"""The verdict on accuracy: differences, clamps and saturations, and what went wrong first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel, WordRanges
from boresight.model.lowering.graph import LEAVES, Node, declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.compare.culprit import find_culprit
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.compare.influence import influences
from boresight.sim.compare.twin import becomes, outside
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import Run

__all__ = ["Accuracy", "judge"]

FloatArray = npt.NDArray[np.float64]

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
        Updates by the name of the value that was clamped, with its line.
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
    """Judge a run of one of a build's estimators, of a log or a closed loop.

    Parameters
    ----------
    records : float64 (n, n_inputs)
        Inputs that it was run on, from a reset on.
    run : Run
        Of any level; in floating point nothing saturates, and only differences are judged. States
        that a level does not show are those of the C.
    reference : Run
        That of float64.
    clamped : mapping of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    """
    program, nodes, clamped = build.programs[number], build.nodes[number], dict(clamped)
    errors = tuple(differences(build.estimators[number].outputs, run.outputs, reference.outputs))
    if run.words is None:
        return Accuracy(errors, 0, {}, (), clamped, "")
    inputs = words_of(program, records)
    states = CModel(program).trajectory(inputs)[2] if run.states is None else run.states
    left = _beyond_declared(program, nodes, states)
    saturated = run.n_saturated
    if not saturated and not left and all(d.good for d in errors):
        return Accuracy(errors, 0, {}, (), clamped, "")
    seen = CModel(program).observe(inputs)
    names = {
        _named(program, nodes, n): int(count) for n, count in enumerate(seen.saturations) if count
    }
    steps = {step for step, _, _ in left}
    steps |= {int(np.argmax(run.saturated))} if run.saturated is not None and saturated else set()
    steps |= {d.first_beyond for d in errors if d.first_beyond is not None}
    ends = [step + 1 for step in sorted(steps)]
    tried = (find_culprit(program, nodes, inputs[:n], states[:n]) for n in ends)
    first = next(filter(None, tried), None)
    culprit = str(first) if first else _rounding(program, nodes, seen, inputs, states, errors)
    endless = [~np.isfinite(values) for values in reference.outputs.values()]
    if any(none.any() for none in endless):
        step = min(int(np.argmax(none)) for none in endless if none.any())
        culprit = f"float64 is no number from step {step} on: the estimator diverges; {culprit}"
    # What saturates is said already.
    named = {becomes(program, nodes, n) for n, count in enumerate(seen.saturations) if count}
    texts = tuple(text for _, state, text in left if state not in named)
    return Accuracy(errors, saturated, names, texts, clamped, culprit)


def _beyond_declared(
    program: Program, nodes: dict[int, Node], states: IntArray
) -> list[tuple[int, int, str]]:
    """States that left their declared ranges: first step, the state, text."""
    out = []
    for k, (state, _) in enumerate(program.states):
        value, reals = program.values[state], program.format(state).real(states[:, k])
        wrong = outside(reals, value)
        if wrong.any():
            step = int(np.argmax(wrong))
            name = declared_name(program, nodes, state)
            said = f"state {name} is {reals[step]:.6g} in step {step}, BEYOND its declared "
            out.append((step, state, f"{said}range [{value.low:g}, {value.high:g}]: widen it"))
    return out


def _named(program: Program, nodes: dict[int, Node], value: int) -> str:
    state = becomes(program, nodes, value)
    if state is not None:
        return f"state {declared_name(program, nodes, state)}"
    line = nodes[value].line if value in nodes else ""
    return program.values[value].name + (f", {line}" if line else "")


#: Share of a difference's root mean square that independent rounding has to explain.
_EXPLAINED = 0.125
#: Values that are named as its sources.
_NAMED = 3


def _rounding(
    program: Program,
    nodes: dict[int, Node],
    seen: WordRanges,
    inputs: IntArray,
    states: IntArray,
    errors: Sequence[Difference],
) -> str:
    """What to do where no single operation is to blame: rounding adds up.

    The values whose rounding makes most of an output's error, where that explains it; else rounding
    is one-sided, and a state loses it (`_coarse`).
    """
    rounding = "no operation leaves its float twin: rounding adds up"
    effects = influences(program, nodes, inputs, states)
    for d in errors:
        own = effects.get(d.output, [])
        explained = math.sqrt(math.fsum(i.rms**2 for i in own))
        if not d.good and own and explained >= _EXPLAINED * d.rms:
            shares = ", ".join(
                f"{i.share:.0%} from {_said(program, nodes, program.find(i.value))}"
                for i in own[:_NAMED]
                if i.share > 0.01
            )
            cure = _cure(program, nodes, seen, program.find(own[0].value))
            left = own[0].one_more_bit / explained
            return (
                f"{rounding}; of the error of {d.output} {shares}; one more bit of the first "
                f"leaves {left:.0%}: {cure}"
            )
    return _coarse(program, nodes, seen, states, rounding)


def _said(program: Program, nodes: dict[int, Node], value: int) -> str:
    """A value, or the state that it becomes, with its line."""
    state, line = becomes(program, nodes, value), nodes[value].line
    name = declared_name(program, nodes, value if state is None else state)
    name = name if state is None else f"state {name}"
    return f"{name} ({line})" if line else name


def _cure(program: Program, nodes: dict[int, Node], seen: WordRanges, value: int) -> str:
    """How a value gets more bits."""
    used = max(int(seen.high[value]), -int(seen.low[value]), 1)
    unused = program.arithmetic.word - 1 - used.bit_length()
    state = becomes(program, nodes, value)
    if state is None and unused > 1:
        return (
            f"it leaves {unused} bits unused: get formats by boresight fit; where these do not "
            "help, narrow inputs and states (boresight fit --propose), use ops.bounded, or a wider "
            "word"
        )
    said = program.values[value if state is None else state]
    narrow = f"narrow its range [{said.low:g}, {said.high:g}], which leaves {unused} bits unused, "
    return (
        (narrow if unused > 1 else "")
        + "use a wider word"
        + ("" if state is None else ", or carry the remainder in a second state")
    )


def _coarse(
    program: Program, nodes: dict[int, Node], seen: WordRanges, states: IntArray, rounding: str
) -> str:
    """The state whose changes have the fewest bits: every update rounds it, perhaps to one side."""
    if not program.states:
        return f"{rounding}; use a wider word"
    changes = np.abs(np.diff(states, axis=0, prepend=states[:1])).max(axis=0)
    computed = [k for k, (_, after) in enumerate(program.states) if _is_computed(nodes, after)]
    k = min(computed or [0], key=lambda k: int(changes[k]))
    state, after = program.states[k]
    value, line = program.values[state], nodes[after].line if after in nodes else ""
    name = declared_name(program, nodes, state)
    used = max(int(seen.high[state]), -int(seen.low[state]), 1)
    unused = program.arithmetic.word - 1 - used.bit_length()
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
