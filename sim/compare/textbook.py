"""Float64 beside a second form of the same equations, where an estimator has one."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import WAIVED, Estimator, SecondForm
from boresight.model.step import called
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import Feed

#: Leading updates that are compared: the second form is slow.
_MOST = 2000
#: Leading updates that show the time step of a model.
_PROBED = 100
#: Largest ratio of a model's time step to that of the log.
_STEPS = 1.25


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
        """One line for people."""
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
