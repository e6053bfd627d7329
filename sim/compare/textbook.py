"""Float64 beside a second form of the same equations; and gates that decide otherwise than it."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import Output
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import WAIVED, Estimator, SecondForm
from boresight.model.kalman.kalman import Kalman
from boresight.model.kalman.textbook import Textbook
from boresight.model.step import called
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level, Run
from boresight.sim.levels.registry import CompiledFloat, Emitted
from boresight.sim.records.feed import Feed

_MOST = 2000  #: Leading updates that are compared: the second form is slow.
_PROBED = 100  #: Leading updates that show the time step of a model.
_STEPS = 1.25  #: Largest ratio of a model's time step to that of the log.


@dataclass(frozen=True)
class Book:
    """Float64 beside the second form."""

    differences: tuple[Difference, ...] = ()
    remarks: tuple[str, ...] = ()  #: warnings about the model, with faults that are waived.
    faults: tuple[str, ...] = ()  #: of the model, which fail the check.
    by_floor: bool = False  #: only the floor of the process noise explains what is beyond.
    gates: tuple[str, ...] = ()  #: accepted and rejected measurements, a line each.

    @property
    def good(self) -> bool:
        """Within the tolerances, but for the floor."""
        return self.by_floor or all(d.good for d in self.differences)

    def line(self) -> str:
        found = self.differences
        texts = ", ".join(f"{d.output} {d.largest:.1e} {d.unit}".rstrip() for d in found)
        beyond = [d.output for d in found if not d.good]
        verdict = f"BEYOND the tolerance of {', '.join(beyond)}" if beyond else "within"
        text = f"float64 against the textbook, {found[0].samples} updates: {texts}: {verdict}"
        return text + ", which floor explains: lower floor, or sd_max" * self.by_floor


def beside_textbook(
    build: Build, number: int, records: FloatArray, floating: Run, step_s: float | None = None
) -> Book:
    """Compare float64 with `Estimator.textbook`; empty without it.

    ``step_s`` is the time step of the log, s, with which those of the model are compared.
    """
    estimator, some = build.estimators[number], records[:_MOST]
    for kind in estimator.waived:
        require_choice(f"estimator {estimator.name}, waived", kind, WAIVED)
    book = _second_form(build, number, some)
    if book is None:
        return Book()
    outputs = {name: values[: len(some)] for name, values in floating.outputs.items()}
    steps = _wrong_steps(estimator, book, step_s)
    faults = [*book.faults, *(("time step", text) for text in steps)]
    found = tuple(differences(estimator.outputs, outputs, book.outputs))
    by_floor = False
    if book.as_built is not None and not all(d.good for d in found):
        as_built = differences(estimator.outputs, outputs, book.as_built())
        by_floor = all(d.good for d in as_built)
    absent = [] if book.absent is None else book.absent(records[_MOST:])
    of = f"{'the first ' * (len(records) > _MOST)}{len(some)} updates"
    return Book(
        found,
        (*absent, *book.remarks, *(text for kind, text in faults if kind in estimator.waived)),
        tuple(text for kind, text in faults if kind not in estimator.waived),
        by_floor,
        tuple(f"{text} in {of}" for text in book.gates),
    )


def wrong_steps(build: Build, given: Feed) -> list[str]:
    """Constant time steps of the model of a build's estimator that are not the log's, a line each.

    ``given`` has the first rows of the log. A textbook form that raises is left to
    `beside_textbook`.
    """
    (estimator,) = build.estimators
    if given.step_s is None or any(i.name == "dt" for i in estimator.inputs):
        return []
    with suppress(InputError):
        if book := _second_form(build, 0, given.inputs[:_PROBED]):
            return _wrong_steps(estimator, book, given.step_s)
    return []


def _second_form(build: Build, number: int, records: FloatArray) -> SecondForm | None:
    """`Estimator.textbook`, checked."""
    estimator = build.estimators[number]
    return called(
        estimator.textbook,
        records,
        build.params[number],
        where=f"estimator {estimator.name}, textbook",
        wanted="a second form or None",
        kind=SecondForm | None,
        answer="return SecondForm(outputs={NAME: ARRAY})",
    )


def _wrong_steps(estimator: Estimator, book: SecondForm, step: float | None) -> list[str]:
    if step is None:
        return []
    return [
        f"estimator {estimator.name}: the model moves {name} by a time step of {abs(own):.4g} s, "
        f"the log has one of {step:.4g} s; take dt as an input, use the log's rate, or "
        'write waived = ("time step",)'
        for name, (own, *others) in book.time_steps.items()
        if own and not any(1 / _STEPS < abs(s) / step < _STEPS for s in (own, *others))
    ]


_REJECTED = "rejected"  #: Output that counts what the gates reject.
#: Largest share of updates that differ in which a gate is to blame, not what it compares.
_FEW = 0.01


def gates_apart(
    build: Build, number: int, pieces: Iterable[tuple[FloatArray, BoolArray]]
) -> tuple[int, str] | None:
    """The first update in which a filter's gates reject more or less than in float64, in words.

    None where they never do, or so often that they are not to blame.
    ``pieces`` are records (n, n_inputs), and which of them begin from the initial states, as their
    first ones do. The filter runs again in C, with an output that counts.
    """
    kalman = build.estimators[number]
    if not isinstance(kalman, Kalman):
        return None
    lines = [str(m.line) for m in Textbook(kalman).measurements if m.gate is not None]
    if not lines:
        return None
    counting = copy(kalman)
    names = [o.name for o in kalman.outputs]
    counting.outputs = (*kalman.outputs, *([] if _REJECTED in names else [Output(_REJECTED)]))
    again = Build(counting, word=build.word, params=[build.params[number]])
    levels: list[Level] = [Emitted(again), CompiledFloat(again)]
    first, step, apart, rows = "", 0, 0, 0
    for records, anew in pieces:
        for level in levels if len(anew) and anew[0] else ():
            level.reset()
        fixed, floating = (level.run(records).outputs[_REJECTED] for level in levels)
        differ = np.flatnonzero(np.rint(fixed) != np.rint(floating))
        if len(differ) and not apart:
            k = int(differ[0])
            step = rows + k
            first = f"{fixed[k]:.0f}, in float64 {floating[k]:.0f}"
        apart, rows = apart + len(differ), rows + len(records)
    if not 0 < apart <= _FEW * rows:
        return None
    wider = "use a wider word, or " * (build.word < 32)
    counts = [name for name in names if name in ("accepted", _REJECTED)] or [_REJECTED]
    shares = [f'Output("{name}", "bits", share={2.0 * apart / rows:.1g})' for name in counts]
    return step, (
        f"step {step}, measurements that the gate ({', '.join(dict.fromkeys(lines))}) rejects: "
        f"{first}; an innovation is within rounding of the gate; {wider}accept that some decisions "
        f"differ, by {' and '.join(shares)}"
    )
