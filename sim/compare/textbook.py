"""Float64 beside a second form of the same equations; and gates that decide otherwise than it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from boresight.model import ops
from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import Output
from boresight.model.errors import InputError, placed, require_choice
from boresight.model.estimator import WAIVED, Estimator, SecondForm
from boresight.model.kalman.declared import Measurement
from boresight.model.kalman.kalman import Kalman
from boresight.model.kalman.textbook import Textbook
from boresight.model.lowering.trace import Expression, Scalar, Trace
from boresight.model.step import called
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build, Level, Run
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
        return text + ", which floor explains; this fails no check" * self.by_floor


def beside_textbook(build: Build, number: int, given: Feed, floating: Run, gates: Gates) -> Book:
    """Compare float64 with `Estimator.textbook`; empty without it.

    ``given`` are the first rows of the log, ``gates`` have counted on all of it.
    """
    estimator, some = build.estimators[number], given.inputs[:_MOST]
    for kind in estimator.waived:
        require_choice(f"estimator {estimator.name}, waived", kind, WAIVED)
    book = _second_form(build, number, some)
    if book is None:
        return Book()
    outputs = {name: values[: len(some)] for name, values in floating.outputs.items()}
    lines, told, wrong = gates.result()
    faults = [*(("gate", text) for text in wrong), *book.faults]
    faults += [("time step", text) for text in _wrong_steps(estimator, book, given.step_s)]
    waived = [text for kind, text in faults if kind in estimator.waived]
    found = tuple(differences(estimator.outputs, outputs, book.outputs))
    by_floor = False
    if book.as_built is not None and not all(d.good for d in found):
        as_built = differences(estimator.outputs, outputs, book.as_built())
        by_floor = all(d.good for d in as_built)
    absent = [] if book.absent is None else book.absent(given.inputs[_MOST:])
    return Book(
        found,
        (*absent, *told, *book.remarks, *waived),
        tuple(text for kind, text in faults if kind not in estimator.waived),
        by_floor,
        tuple(lines),
    )


def wrong_steps(build: Build, inputs: FloatArray, step: float | None) -> list[str]:
    """Constant time steps of the model of a build's estimator that are not ``step``, a line each.

    ``inputs`` (n, n_inputs) are the first records. A textbook form that raises is left to
    `beside_textbook`.
    """
    (estimator,) = build.estimators
    if step is None or any(i.name == "dt" for i in estimator.inputs):
        return []
    with suppress(InputError):
        if book := _second_form(build, 0, inputs[:_PROBED]):
            return _wrong_steps(estimator, book, step)
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
        f"the records have one of {step:.4g} s; take dt as an input, use their rate, or "
        'write waived = ("time step",)'
        for name, (own, *others) in book.time_steps.items()
        if own and not any(1 / _STEPS < abs(s) / step < _STEPS for s in (own, *others))
    ]


_ACCEPTED, _REJECTED = "accepted", "rejected"  #: Outputs that count what the gates do.
#: Share of its measurements that a gate accepts at least: not to fail, and without a remark.
_PASSED, _USUAL = 0.1, 0.5
#: Least number, and share, of the last measurements, all rejected, that a filter has lost.
_LOST, _LOST_SHARE = 50, 0.1
#: Largest number, beside a share, of updates in which a decision is to blame, not what it compares.
_FEW, _FEW_SHARE = 3.0, 0.01


def _gated(estimator: Estimator) -> list[tuple[int, Measurement]]:
    """The measurements of a filter that have a gate, each with its number."""
    if not isinstance(estimator, Kalman):
        return []
    return [(n, m) for n, m in enumerate(Textbook(estimator).measurements) if m.gate is not None]


class Gates:
    """What each gate of a filter accepts and rejects on the whole log, in float64."""

    def __init__(self, build: Build, number: int) -> None:
        self._gated = _gated(build.estimators[number])
        #: Of each gate: accepted, rejected, rejected since the last accepted one.
        self._counts = [(0, 0, 0)] * len(self._gated)
        if self._gated:
            counting = copy(build.estimators[number])
            names = product((_ACCEPTED, _REJECTED), (n for n, _ in self._gated))
            counting.outputs = tuple(Output(f"gate_{name}_{n}") for name, n in names)
            counting.prior = False  # type: ignore[attr-defined]  # of a Kalman
            self._level = CompiledFloat(Build(counting, params=[build.params[number]]))

    def add(self, inputs: FloatArray, *, anew: bool = False) -> None:
        """Count in the next rows, which perhaps begin from the initial states."""
        if not self._gated:
            return
        if anew:
            self._level.reset()
        outputs = self._level.run(inputs).outputs
        for k, (n, _) in enumerate(self._gated):
            taken, left = (outputs[f"gate_{name}_{n}"] > 0.5 for name in (_ACCEPTED, _REJECTED))
            accepted, rejected, last = self._counts[k]
            end = int(np.flatnonzero(taken).max(initial=-1))
            last = int(left[end + 1 :].sum()) + last * (end < 0)
            self._counts[k] = accepted + int(taken.sum()), rejected + int(left.sum()), last

    def result(self) -> tuple[list[str], list[str], list[str]]:
        """Lines about all gates, remarks, and faults."""
        lines, remarks, faults = list[str](), list[str](), list[str]()
        for (_, m), (accepted, rejected, last) in zip(self._gated, self._counts, strict=True):
            subject, valid = placed(m.line, "measurement"), accepted + rejected
            lines.append(f"gate {subject}: {accepted} accepted, {rejected} rejected")
            is_lost = last >= max(_LOST, _LOST_SHARE * valid)
            found = f"none in the last {last} of {valid}"
            if accepted < _PASSED * valid:
                is_lost, found = True, f"{accepted or 'none'} in {valid}"
            if is_lost:
                faults.append(
                    f"{subject}: wanted innovations within the gate of {m.gate:g} standard "
                    f"deviations, found {found} updates; raise r, sd, the process noise or the gate"
                )
            elif accepted < _USUAL * valid:
                remarks.append(
                    f"{subject}: the gate of {m.gate:g} standard deviations rejects {rejected} of "
                    f"{valid} measurements; raise r, the process noise or the gate"
                )
        return lines, remarks, faults


def with_outputs(estimator: Estimator, made: Callable[[Trace], dict[str, Scalar]]) -> Estimator:
    """An estimator with other outputs, which are made of its trace."""
    other, outputs = copy(estimator), made(estimator.trace())
    other.outputs, other.profile = tuple(map(Output, outputs)), None
    vars(other)["trace"] = lambda: replace(trace := estimator.trace(), outputs=made(trace))
    return other


def decisions_apart(
    build: Build, number: int, pieces: Iterable[tuple[FloatArray, BoolArray]]
) -> tuple[int, str] | None:
    """The first update in which a comparison decides otherwise than in float64, in words.

    Of a Kalman filter one of its gates. None where none does, or only those that do so often that
    they are not to blame. ``pieces`` are records (n, n_inputs), and which of them begin from the
    initial states, as their first ones do. The estimator runs again in C, with other outputs.
    """
    estimator = build.estimators[number]
    is_kalman, gates = isinstance(estimator, Kalman), {str(m.line) for _, m in _gated(estimator)}

    def compared(trace: Trace) -> list[Expression]:
        less = (e for e in trace.needed if e.kind == "less")
        return [e for e in less if not is_kalman or e.line in gates]

    lines = [e.line for e in compared(estimator.trace())]
    if not lines:
        return None
    other = with_outputs(
        estimator, lambda t: {f"c{k}": ops.where(e, 1.0, 0.0) for k, e in enumerate(compared(t))}
    )
    again = Build(other, word=build.word, params=[build.params[number]])
    levels: list[Level] = [Emitted(again), CompiledFloat(again)]
    first, apart, rows = np.full(len(lines), np.inf), np.zeros(len(lines)), 0
    for records, anew in pieces:
        for level in levels if len(anew) and anew[0] else ():
            level.reset()
        fixed, floating = (np.array([*level.run(records).outputs.values()]) for level in levels)
        differ = fixed != floating
        at = np.where(differ.any(axis=1), rows + differ.argmax(axis=1), np.inf)
        first, apart, rows = np.minimum(first, at), apart + differ.sum(axis=1), rows + len(records)
    first[apart > _FEW + _FEW_SHARE * rows] = np.inf
    k = int(np.argmin(first))
    if first[k] == np.inf:
        return None
    counts = [o.name for o in estimator.outputs if o.name in (_ACCEPTED, _REJECTED)]
    names = (counts or [_REJECTED]) if is_kalman else ["NAME"]
    shares = [f'Output("{name}", "bits", share={2.0 * apart[k] / rows:.1g})' for name in names]
    wider = "use a wider word, or " * (build.word < 32)
    return int(first[k]), (
        f"step {first[k]:.0f}, {'a gate' if is_kalman else 'a comparison'} ({lines[k]}) decides "
        f"otherwise than in float64, as in {apart[k]:.0f} of {rows} updates: its sides are within "
        f"rounding; {wider}accept that some decisions differ, by {' and '.join(shares)}"
        + " of it"
        * (not is_kalman)
    )
