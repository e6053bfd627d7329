"""What a check found: a verdict for each level, and all of them for one estimator on one record."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.estimator import WAIVED
from boresight.model.lowering.profile import Profile
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.claims import ClaimResult, claim_lines
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.textbook import Book
from boresight.sim.compare.twin import Traced
from boresight.sim.compare.verdict import Accuracy
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import Level, Run
from boresight.sim.records.feed import Feed
from boresight.sim.result import JsonObject, plain


@dataclass(frozen=True)
class LevelResult:
    """One level's verdict.

    ``n_mismatch`` counts the updates, of ``n_total``, whose outputs, states or saturation flag
    differ, and ``first_wrong`` is the first of them. ``error`` says why a level did not run, or
    why its run proves nothing: then there are no counts (None). Cycles are None for levels without
    a clock. ``reference`` marks the interpreter, with which the others are compared.
    """

    level: str
    simulator: str
    n_total: int | None
    n_mismatch: int | None
    seconds: float
    cycles_predicted: int | None = None
    cycles_min: int | None = None
    cycles_max: int | None = None
    interval_predicted: int | None = None
    interval_min: int | None = None
    interval_max: int | None = None
    error: str = ""
    divergence: str = ""
    first_wrong: int | None = None
    reference: bool = False

    @property
    def good(self) -> bool:
        """Ran, compared something, and found no difference in words or cycles."""
        return not self.failure

    @property
    def failure(self) -> str:
        """Why it failed; empty where it did not."""
        if self.error:
            return self.error
        if not self.n_total:
            return "no update was compared"
        if self.n_mismatch:
            return f"{self.n_mismatch} of {self.n_total} updates differ"
        if not self.cycles_min == self.cycles_predicted == self.cycles_max:
            return self._counted("cycles")
        if not self.interval_min == self.interval_predicted == self.interval_max:
            return self._counted("interval")
        return ""

    def _counted(self, name: str) -> str:
        predicted, low, high = (getattr(self, f"{name}_{x}") for x in ("predicted", "min", "max"))
        counted = f"{low}" if low == high else f"{low}..{high}"
        return f"{name} predicted {predicted}, counted {counted}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {**dataclasses.asdict(self), "good": self.good, "failure": self.failure}

    def line(self) -> str:
        """One line for people; what `error` says stands in the verdict, once for all levels."""
        name = f"{self.level:8s} {self.simulator:12s}"
        if self.error:
            return f"{name} FAILED"
        text = f"{name} [{self.n_mismatch}/{self.n_total}] mismatches"
        if self.reference:
            text = f"{name} reference, {self.n_total} updates"
        if self.cycles_predicted is not None:
            text += f"   {self._counted('cycles')}; {self._counted('interval')}"
        return f"{text}   {self.seconds:.1f} s" + (
            f"\n         {self.divergence}" if self.divergence else ""
        )


class Agreement:
    """A level by its words, flags, states if it shows them, and cycles if it has a clock."""

    def __init__(self, level: Level) -> None:
        self.level = level
        self.first_wrong: int | None = None  #: First update that differs.
        self._total, self._mismatch, self._fault = 0, 0, ""
        self._cycles: dict[str, int] = {}

    def add(self, run: Run, wanted: Run, start: int) -> int | None:
        """The rows from ``start`` on; ``wanted`` are the interpreter's, or more.

        Returns the row among them that is `first_wrong`.
        """
        assert run.words is not None and wanted.words is not None
        assert run.saturated is not None and wanted.saturated is not None
        assert run.beyond is not None and wanted.beyond is not None
        n = len(run.words)
        self._fault = self._fault or run.fault
        if not n:
            return None
        same = (run.words == wanted.words[:n]).all(axis=1)
        same &= run.saturated == wanted.saturated[:n]
        same &= run.beyond == wanted.beyond[:n]
        if run.states is not None:
            assert wanted.states is not None
            same &= (run.states == wanted.states[:n]).all(axis=1)
        if (plan := self.level.schedule) is not None:
            assert run.latency_cycles is not None and run.interval_cycles is not None
            self._count("cycles", plan.latency, run.latency_cycles[:, : plan.urgent].max(axis=1))
            self._count("interval", plan.interval, run.interval_cycles)
        wrong = n - int(np.count_nonzero(same))
        self._total, self._mismatch = self._total + n, self._mismatch + wrong
        if not wrong or self.first_wrong is not None:
            return None
        row = int(np.argmin(same))
        self.first_wrong = row + start
        return row

    def _count(self, name: str, predicted: int, counted: IntArray) -> None:
        low, high = int(counted.min()), int(counted.max())
        self._cycles |= {
            f"{name}_predicted": predicted,
            f"{name}_min": min(low, self._cycles.get(f"{name}_min", low)),
            f"{name}_max": max(high, self._cycles.get(f"{name}_max", high)),
        }

    def result(self, seconds: float = 0.0, divergence: str = "") -> LevelResult:
        """The verdict."""
        return LevelResult(
            self.level.name,
            self.level.tool,
            None if self._fault else self._total,
            None if self._fault else self._mismatch,
            seconds,
            **self._cycles,  # type: ignore[arg-type]
            error=self._fault,
            divergence=divergence,
            first_wrong=self.first_wrong,
        )


def first_difference(
    level: Level, pieces: Iterable[tuple[FloatArray, bool]], before: IntArray | None, step: int
) -> str:
    """Run a level up to ``step`` again, alone: the first value that differs; empty if none does.

    ``pieces`` are records (n, n_inputs) in their units, and whether they begin from the initial
    states; ``before`` are the interpreter's state words (n_states,) before the step; None: the
    initial ones.
    """
    of = Traced.of(level.build, level.number)
    program = level.program if level.schedule is None else level.schedule.program
    machine, rows, earlier = Interpreter(program), step + 1, list[FloatArray]()
    if before is not None:
        machine.states = before[:, None]
    for piece, anew in pieces:
        if anew:
            earlier = []
        earlier.append(piece[:rows])
        rows -= len(piece)
        if rows <= 0:
            break
    last = earlier.pop()
    machine.update(words_of(level.program, last[-1])[:, None])
    wanted = [int(w[0]) for w in machine.values_before_commit()]
    for seen in level.words_of_update(last, earlier):
        if seen.word != wanted[seen.value]:
            at = "" if seen.cycle is None else f", cycle {seen.cycle}"
            found = "X" if seen.word is None else str(seen.word)
            is_copy = seen.value >= len(of.program.values)  # which the schedule adds
            name = program.values[seen.value].name if is_copy else of.place(seen.value)
            return (
                f"{level.name}: first difference in {name}, step {step}{at}: wanted "
                f"{wanted[seen.value]}, found {found}"
            )
    return ""


class Part(NamedTuple):
    """Rows of a log: what an estimator ran on, fixed point and float64."""

    given: Feed
    fixed: Run
    floating: Run


@dataclass(frozen=True, eq=False)
class CheckResult:
    """All levels on one record, and the float comparison that goes with them."""

    build: Build = field(repr=False)
    number: int  #: which of its estimators was checked.
    #: What it ran on; of a long log whose rows are not kept, as `fixed` and `floating`, the leading
    #: rows (`sim.compare.check.KEPT`).
    given: Feed = field(repr=False)
    levels: tuple[LevelResult, ...]
    accuracy: Accuracy
    fixed: Run = field(repr=False)  #: the interpreter's, with which every level was compared.
    floating: Run = field(repr=False)
    book: Book = field(default_factory=Book)  #: float64 beside `Estimator.textbook`.
    truth: tuple[Difference, ...] = ()  #: errors of fixed point against the log's true values.
    comparison: bool = False  #: these are another device's estimates: then limits do not count.
    claims: tuple[ClaimResult, ...] = ()  #: of `ops.bounded`, and the ranges of states.
    rows: int = 0  #: of the log.
    #: Of a long log all rows once more, as `parts`: those of fixed point are the C's.
    again: Callable[[], Iterator[Part]] | None = field(default=None, repr=False)

    def parts(self) -> Iterator[Part]:
        """All rows of the log, piece by piece: what it ran on, fixed point and float64."""
        if self.again is not None:
            return self.again()
        return iter([Part(self.given, self.fixed, self.floating)])

    @property
    def estimator(self) -> str:
        """Name of the estimator."""
        return self.build.estimators[self.number].name

    @property
    def identity(self) -> str:
        """That of the core (`gateware.core.Core.identity`); empty if none holds the programs."""
        return "" if self.build.shortage else self.build.core.identity

    @property
    def textbook(self) -> tuple[Difference, ...]:
        """Float64 beside the second form."""
        return self.book.differences

    @property
    def profile(self) -> Profile | None:
        """The profile that chose the formats, if there is one."""
        return self.build.estimators[self.number].profile

    @property
    def failures(self) -> list[str]:
        """What is wrong, one line each; empty if `good`."""
        levels = [f"{x.level} in {x.simulator}: {x.failure}" for x in self.levels if x.failure]
        book = [] if self.book.good else [self.book.line()]
        none = [] if self.levels else ["no form was run"]
        claims = [claim.failure for claim in self.claims if claim.failure]
        wrong = [f"against truth: {e.line()}" for e in self.truth if not e.good]
        faults = [*claims, *book, *self.book.faults, *([] if self.comparison else wrong)]
        return [*levels, *self.accuracy.faults(), *faults, *none]

    @property
    def exact(self) -> bool | None:
        """Every level ran and equals the integer model; None if no level was compared with it."""
        if not all(level.good for level in self.levels):
            return False
        return True if any(not level.reference for level in self.levels) else None

    @property
    def good(self) -> bool:
        """Nothing failed: levels, accuracy, claims and the textbook form."""
        return not self.failures

    def lines(self) -> list[str]:
        """Everything, for people."""
        reference = "a comparison" if self.comparison else "truth"
        return [
            f"{self.estimator} on {self.given.record.name}, {self.build.config}, "
            f"W = {self.build.word}{', core ' * bool(self.identity)}{self.identity}",
            *(f"  {level.line()}" for level in self.levels),
            *([] if self.profile is None else [f"  {self.profile}"]),
            *(f"  {text}" for text in self.accuracy.lines()),
            *(f"  against {reference}: {e.line()}" for e in self.truth),
            *([f"  {self.book.line()}"] if self.textbook else []),
            *(f"  {text}" for text in self.book.gates),
            *(f"  model: {text}" for text in self.book.faults),
            *(f"  {text}" for text in claim_lines(self.claims)),
            *(f"  {claim.failure}" for claim in self.claims if claim.failure),
            *(f"  warning: {text}" for text in self.given.warnings),
        ]

    def __str__(self) -> str:
        return "\n".join((*self.lines(), verdict([self])))

    def to_json(self) -> JsonObject:
        """Plain data for --json."""
        return {
            "estimator": self.estimator,
            "log": self.given.record.name,
            "config": self.build.config,
            "word": self.build.word,
            "program": self.build.programs[self.number].digest,
            "identity": self.identity,
            "parameters": plain(self.build.values[self.number]),
            "profile": None if self.profile is None else self.profile.place,
            "good": self.good,
            "exact": self.exact,
            "accuracy": plain(self.accuracy),
            "truth": [e.to_json() for e in self.truth],
            "textbook": [d.to_json() for d in self.textbook],
            "waived": {kind: kind in self.build.estimators[self.number].waived for kind in WAIVED},
            "model_faults": list(self.book.faults),
            "claims": [claim.to_json() for claim in self.claims],
            "warnings": list(self.given.warnings),
            "verification": [x.to_json() for x in self.levels],
        }


def verdict(results: Sequence[CheckResult]) -> str:
    """``good``, or ``FAILED`` with the first failure of each result; what they share, once."""
    names: dict[str, list[str]] = {}
    for result in results:
        for text in result.failures[:1]:
            name = f"{result.estimator} on {result.given.record.name}"
            names.setdefault(" ".join(text.split()), []).append(name)
    if not names:
        return "good"
    shared = [text for text, where in names.items() if len(where) == len(results)]
    own = [f"{', '.join(where)}: {text}" for text, where in names.items() if text not in shared]
    return f"FAILED: {'; '.join(shared + own)}"
