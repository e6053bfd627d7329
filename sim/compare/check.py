"""A check: every level on the same records, bit by bit and cycle by cycle, and against float64."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise, zip_longest

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import PERIODS, Output
from boresight.model.errors import ToolMissing, require, require_choice
from boresight.model.estimator import Estimator
from boresight.model.tools.external import ToolFailed
from boresight.model.words.fixed import IntArray
from boresight.sim.accuracy.covariance import own_covariance
from boresight.sim.compare.claims import FoldedClaims, claim_results
from boresight.sim.compare.difference import Differences, around
from boresight.sim.compare.results import (
    Agreement,
    CheckResult,
    LevelResult,
    Part,
    first_difference,
)
from boresight.sim.compare.soundness import check_sound
from boresight.sim.compare.textbook import beside_textbook
from boresight.sim.compare.twin import RANGE_SLACK
from boresight.sim.compare.verdict import Judge
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted, Interpreted
from boresight.sim.levels.level import Level, Run
from boresight.sim.levels.registry import LEVELS
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.examine import Examined, examine
from boresight.sim.records.feed import Feed, Feeder
from boresight.sim.records.files import Log
from boresight.sim.records.plausible import estimate_warnings
from boresight.sim.records.record import TRUTH, Record, truth_names
from boresight.sim.rtl.simulators import SIMULATORS

#: Levels that can be checked.
EXACT = tuple(name for name, level in LEVELS.items() if level.exact)
#: Rows of a log that are read at a time, and of a long one those that are kept.
KEPT = 1 << 16
#: Typical error in an estimator's own standard deviations, beyond which it is told.
_SURE = 10.0
#: Warning where nothing decides whether rounding is small enough.
_BARE = "no output has a tolerance, so that rounding is not judged; give tolerance=, or --tolerance"
#: Rows that run on a level at a time.
ROWS = 1 << 15


class _Attempt:
    """A level of every estimator, as far as it came."""

    def __init__(self, kind: type[Level], tool: str, make: Callable[[], list[Level]]) -> None:
        self.kind, self.tool, self._make = kind, tool, make
        self.levels: list[Level] = []
        self.agreements: list[Agreement] = []
        self.seconds, self.error = 0.0, ""
        #: Records of each estimator on which it still runs; None: on all.
        self.left: int | None = None
        self._pieces = 0
        #: By estimator, states before its first update that differs.
        self.differs: dict[int, IntArray | None] = {}

    def begin(self) -> None:
        """Make the levels."""

        def make() -> list[Run]:
            self.levels = self._make()
            self.agreements = [Agreement(level) for level in self.levels]
            self.left = self.levels[0].record_limit
            return []

        self._guarded(make)

    def advance(self, records: Sequence[FloatArray], anew: bool) -> list[Run]:
        """The next records of each estimator: their runs, if there are any."""
        if self.left is not None:
            records = [x[: self.left] for x in records]
            self.left -= max(map(len, records))
        if self.error or not any(map(len, records)):
            return []
        seed, self._pieces = self._pieces, self._pieces + 1
        run = partial(self.kind.run_together, self.levels, records, anew=anew, seed=seed)
        return self._guarded(run)

    def compare(self, k: int, runs: Sequence[Run], wanted: Run, case: _Case) -> None:
        """Compare the next records of estimator ``k`` with the interpreter's run of them."""
        assert wanted.states is not None
        if runs and (row := self.agreements[k].add(runs[k], wanted, case.rows)) is not None:
            self.differs[k] = wanted.states[row - 1] if row else case.before

    def _guarded(self, call: Callable[[], Iterable[Run]]) -> list[Run]:
        start = time.perf_counter()
        try:
            return [*call()]
        except (ToolMissing, ToolFailed) as failed:
            self.error = str(failed).strip().splitlines()[0]
            return []
        finally:
            self.seconds += time.perf_counter() - start

    def result(
        self, number: int, again: Callable[[], Iterable[tuple[FloatArray, IntArray, BoolArray]]]
    ) -> LevelResult:
        """The verdict on one estimator: on a mismatch with the first value that differs."""
        if self.error:
            return LevelResult(
                self.kind.name, self.tool, None, None, self.seconds, error=self.error
            )
        level, agreement, text = self.levels[number], self.agreements[number], ""
        if number in self.differs:
            assert agreement.first_wrong is not None
            step = agreement.first_wrong
            pieces = ((rows, bool(new[0])) for rows, _, new in again())
            text = first_difference(level, pieces, self.differs[number], step)
            many = len(self.levels)
            rest = f"with {many} programs in turns" if many > 1 else "all values equal"
            text = text or f"{level.name}: outputs differ, step {step}, {rest}"
        return agreement.result(self.seconds, text)


@dataclass(eq=False)
class _Case:
    """One estimator on its log: what has been seen of it, and what is kept."""

    outputs: Sequence[Output]
    judge: Judge
    folded: FoldedClaims
    rows: int = 0
    #: Errors of the interpreter against the true values of the log.
    truth: Differences | None = None
    #: The interpreter's states before the piece at hand; None: it begins from the initial ones.
    before: IntArray | None = None
    feeds: list[Feed] = field(default_factory=list)
    pieces: list[Part] = field(default_factory=list)
    clamped: Mapping[str, int] = field(default_factory=dict)
    warnings: dict[str, None] = field(default_factory=dict)
    #: Warnings about the rows so far.
    told: Sequence[str] = ()

    def take(self, block: Feed, keep_all: bool) -> None:
        """Rows of the log; they are kept, those of a long log only to keep all."""
        if not len(block):
            return
        self.truth = self.truth or Differences(self.outputs, block.truth, judged=False)
        self.clamped, self.told = block.clamped, block.warnings
        if keep_all or not self.feeds:
            self.feeds.append(block)

    def add(self, part: Part, keep_all: bool) -> None:
        """Judge the next rows."""
        given, start, anew = part.given, self.rows, self.before is None
        states = self.judge.add(given.inputs, part.fixed, part.floating, anew=anew)
        self.folded.add(given.inputs, anew=anew)
        if self.truth is not None:
            truth = {n: np.where(given.counts, v, np.nan) for n, v in given.truth.items()}
            self.truth.add(part.fixed.outputs, truth)
        self.before, self.rows = states[-1], start + len(given)
        if keep_all or start < KEPT:
            self.pieces.append(part)

    @property
    def complete(self) -> bool:
        """Whether all rows are kept."""
        return sum(len(part.given) for part in self.pieces) == self.rows


class Check:
    """The estimators of one core on records, on as many records as wanted: all is built once.

    Parameters
    ----------
    build : Build
        Estimators in one core; where they are several, they take turns on the RTL.
    levels : sequence of str, optional
        Which of `EXACT`; by default all. The integer interpreter, with which each is
        compared, and float64 run in any case.
    simulator : str, optional
        Verilator or Icarus (not all updates); by default Verilator, or Icarus without it.
    progress : callable, optional
        Told what runs.
    search : bool
        Whether claims that intervals do not prove are searched for inputs that break them, which
        takes half a second.

    Raises
    ------
    InputError
        Unknown level or simulator.
    """

    def __init__(
        self,
        build: Build,
        *,
        levels: Sequence[str] = EXACT,
        simulator: str | None = None,
        progress: Callable[[str], None] | None = None,
        search: bool = True,
    ) -> None:
        levels = levels.split(",") if isinstance(levels, str) else levels
        for level in levels:
            require_choice("levels", level, EXACT)
        if simulator is not None:
            require_choice("simulator", simulator, SIMULATORS)
        self.build, self.levels, self.simulator, self.search = build, levels, simulator, search
        self.progress = progress or (lambda text: None)
        self._count = len(build.estimators)
        #: `Build.shortage`; None until the first records have been looked at.
        self._shortage: str | None = None
        self._made: dict[tuple[type[Level], str | None], list[Level]] = {}
        #: Proofs and searches of the claims of each estimator, made once.
        self._examined: dict[int, list[Examined]] = {}

    def run(
        self, *logs: Log | Record, keep_all: bool = True, rows: int = ROWS
    ) -> list[CheckResult]:
        """Run everything, a piece of the logs after the other on every level.

        Returns a result for each estimator. Raises InputError for a record that does not feed its
        estimator, or what no core could compute right (`sim.compare.soundness`); ToolMissing
        without a C compiler.

        Parameters
        ----------
        logs : Log or Record
            One for all estimators, or one for each of them; they may differ in length.
        keep_all : bool
            Whether results have the rows of a log of more than `KEPT`.
        rows : int
            Rows of a piece.
        """
        sources = [Log.of(log) for log in logs]
        build = self.build
        cases = [
            _Case(
                estimator.outputs,
                Judge(build, k, curves=keep_all),
                FoldedClaims(
                    estimator, claims_of(build.programs[k], build.nodes[k]), build.params[k]
                ),
                warnings=dict.fromkeys(filter(None, [estimator.start_note(build.word)])),
            )
            for k, estimator in enumerate(build.estimators)
        ]
        attempts = [
            _Attempt(LEVELS[name], tool, partial(self._levels, LEVELS[name], tool))
            for name in self.levels
            if name != Interpreted.name
            for tool in LEVELS[name].tools_of_check(self.simulator)
        ]
        interpreter = _Attempt(
            Interpreted, Interpreted.tools[0], partial(self._levels, Interpreted)
        )
        begun = False
        for blocks in self._blocks(sources):
            for case, block in zip(cases, blocks, strict=True):
                case.take(block, keep_all)
            if not begun:
                self._begin(cases, [b.inputs for b in blocks], [*attempts, interpreter])
            for piece, anew in _pieces(blocks, rows, not begun):
                self._piece(cases, piece, anew, attempts, interpreter, keep_all)
                begun = True
        results = []
        for k, case in enumerate(cases):
            again = partial(self._again, k, case, sources)
            levels = [x.result(k, again) for x in attempts]
            own = interpreter.agreements[k].result(interpreter.seconds)
            if Interpreted.name in self.levels or own.error:
                levels.insert(0, dataclasses.replace(own, reference=True))
            results.append(self._result(k, case, sources, levels, again))
        return results

    def _blocks(self, sources: Sequence[Log]) -> Iterator[list[Feed]]:
        """Blocks of `KEPT` rows of each estimator's log; none of one that has ended."""
        feeders = [Feeder(e) for e in self.build.estimators]
        if len(sources) == 1:
            for rows in sources[0].blocks(KEPT):
                yield [feeder.take(rows) for feeder in feeders]
            return
        own = [
            map(feeder.take, source.blocks(KEPT))
            for feeder, source in zip(feeders, sources, strict=True)
        ]
        empty: list[Feed] = []
        for several in zip_longest(*own):
            empty = empty or [block.rows(0, 0) for block in several]
            yield [block or none for block, none in zip(several, empty, strict=True)]

    def _begin(
        self, cases: Sequence[_Case], records: Sequence[FloatArray], attempts: Sequence[_Attempt]
    ) -> None:
        """Look at the leading rows, and begin on every level."""
        if self._shortage is None:
            check_sound(self.build, records)
            self._shortage = self.build.shortage
        if self._shortage:
            text = f"no core, as compile would make it: {self._shortage}"
            for case in cases:
                case.warnings[text] = None
        for text in dict.fromkeys(text for case in cases for text in (*case.told, *case.warnings)):
            self.progress(f"warning: {text}")
        names = ["float64"]
        for attempt in attempts:
            attempt.begin()
            slow = " (slow: --simulator verilator is faster)" * (attempt.tool == "icarus")
            names.append(f"{attempt.kind.name} in {attempt.tool}{slow}")
        self.progress(", ".join(names))

    def _levels(self, kind: type[Level], tool: str | None = None) -> list[Level]:
        """A level for each estimator, made once."""
        if (kind, tool) not in self._made:
            self._made[kind, tool] = [kind(self.build, k, tool) for k in range(self._count)]
        return self._made[kind, tool]

    def _piece(
        self,
        cases: Sequence[_Case],
        piece: Sequence[Feed],
        anew: bool,
        attempts: Sequence[_Attempt],
        interpreter: _Attempt,
        keep_all: bool,
    ) -> None:
        """Run a piece on every level, and compare."""
        records = [rows.inputs for rows in piece]
        floating = CompiledFloat.run_together(self._levels(CompiledFloat), records, anew=anew)
        tried = [attempt.advance(records, anew) for attempt in attempts]
        fixed = interpreter.advance(records, anew)
        for k, part in enumerate(map(Part, piece, fixed, floating)):
            if len(part.given):
                cases[k].before = None if anew else cases[k].before
                for attempt, runs in zip((interpreter, *attempts), (fixed, *tried), strict=True):
                    attempt.compare(k, runs, part.fixed, cases[k])
                cases[k].add(part, keep_all)

    def _again(
        self, number: int, case: _Case, sources: Sequence[Log]
    ) -> Iterator[tuple[FloatArray, IntArray, BoolArray]]:
        """Records of an estimator piece by piece, their states (kept, or the C's), restarts."""
        for part in case.pieces if case.complete else self._parts(number, sources):
            assert part.fixed.states is not None
            yield part.given.inputs, part.fixed.states, part.given.restarts

    def _parts(self, number: int, sources: Sequence[Log]) -> Iterator[Part]:
        """Every row of an estimator's log, with the C and float64."""
        kinds: tuple[type[Level], ...] = (Emitted, CompiledFloat)
        levels = [[kind(self.build, k) for k in range(self._count)] for kind in kinds]
        begun = False
        for blocks in self._blocks(sources):
            for piece, anew in _pieces(blocks, KEPT, not begun):
                begun, records = True, [rows.inputs for rows in piece]
                fixed, floating = (
                    kind.run_together(x, records, anew=anew)[number]
                    for kind, x in zip(kinds, levels, strict=True)
                )
                if len(records[number]):
                    yield Part(piece[number], fixed, floating)

    def _result(
        self,
        number: int,
        case: _Case,
        sources: Sequence[Log],
        levels: Sequence[LevelResult],
        again: Callable[[], Iterator[tuple[FloatArray, IntArray, BoolArray]]],
    ) -> CheckResult:
        """All of an estimator on its log."""
        accuracy, given = case.judge.result(case.clamped, again), Feed.joined(case.feeds)
        reference = Run.joined([part.floating for part in case.pieces])
        anew = np.flatnonzero(given.restarts[1:])
        first = given.rows(0, int(anew[0]) + 1) if len(anew) else given
        book = beside_textbook(self.build, number, first.inputs, reference, first.step_s)
        run = Run.joined([part.fixed for part in case.pieces])
        estimator, source = self.build.estimators[number], sources[number % len(sources)]
        outputs = {name: values[: len(given)] for name, values in run.outputs.items()}
        told = estimate_warnings(estimator, given.inputs, given.new, outputs)
        near = [accuracy.near_floor] if accuracy.near_floor and accuracy.good else []
        strange = _strange_truth(estimator, given)
        sure = [] if strange or source.comparison else _too_sure(self.build, number, given, run)
        judged = any(d.tolerance is not None for d in accuracy.differences)
        bare = [] if judged else [_BARE]
        bare += _without_truth(estimator, given)
        late = (*book.remarks, *told, *strange, *sure, *near, *bare)
        for text in late:
            self.progress(f"warning: {text}")
        given = dataclasses.replace(
            given, clamped=dict(case.clamped), warnings=(*case.told, *case.warnings, *late)
        )
        examined = self._claims_of(number)
        broken = {examined[k].claim for k in accuracy.broken if k < len(examined)}
        program, seen = self.build.programs[number], accuracy.reached
        claims = claim_results(program, examined, seen, broken) if examined else ()
        return CheckResult(
            self.build,
            number,
            given,
            tuple(levels),
            accuracy,
            run,
            reference,
            book,
            tuple(d for d in case.truth.result() if d.samples) if case.truth else (),
            source.comparison,
            (*claims, *case.folded.result()),
            case.rows,
            None if case.complete else partial(self._parts, number, sources),
        )

    def _claims_of(self, number: int) -> list[Examined]:
        """Prove the claims of an estimator, or search for inputs that break them; once."""
        build = self.build
        if not self.search:
            return []
        if number not in self._examined:
            estimator, program = build.estimators[number], build.programs[number]
            self.progress(f"stated ranges of {estimator.name}")
            self._examined[number] = examine(estimator, program, build.nodes[number])
        return self._examined[number]


#: A whole turn in the units of angles that are not compared modulo it.
_TURNS = {"deg": 360.0, "rad": 2.0 * math.pi}


def _strange_truth(estimator: Estimator, given: Feed) -> list[str]:
    """Lines about true values that the state of their name cannot have.

    An angle may be given by more than one turn, if the column has a unit.
    """
    lines, names = list[str](), truth_names(given.record)
    units = {o.name: o.unit for o in estimator.outputs}
    for s in estimator.states:
        values = given.truth.get(s.name, np.zeros(0))
        values = values[np.isfinite(values)]
        if not len(values) or units[s.name] != s.unit:
            continue
        column, turn = names[s.name], PERIODS.get(s.unit, 0.0)
        has_unit = given.record.columns[column].unit is not None
        if turn and (has_unit or (values.min() >= 0.0 and values.max() <= turn)):
            continue
        slack = RANGE_SLACK * (s.high - s.low)
        far = max(values, key=lambda v: max(s.low - v, v - s.high))
        if not s.low - slack <= far <= s.high + slack:
            unit = "deg" if turn else "UNIT"
            cures = [] if has_unit else [f"name its unit in the header, as {column}[{unit}]"]
            whole = _TURNS.get(s.unit, math.inf)
            if s.high - s.low >= whole * (1.0 - RANGE_SLACK) and s.high - s.low < 1.5 * whole:
                cures.append("declare state and output in ht, which is compared modulo a turn")
            else:
                cures += [] if turn else ["widen the state"]
            lines.append(
                f"column {column}: {far:.4g} {s.unit or 'without unit'} is beyond the range "
                f"[{s.low:g}, {s.high:g}] of the state {s.name}; {', or '.join(cures)}"
            )
    return lines


def _without_truth(estimator: Estimator, given: Feed) -> list[str]:
    """Lines about outputs with a limit truth= for which the log has no true value."""
    return [
        f"{o.name}: truth={o.truth:g} is not judged: the log has no true value of it, "
        f"{o.name}{TRUTH}"
        for o in estimator.outputs
        if o.truth is not None and not np.isfinite(given.truth.get(o.name, np.nan)).any()
    ]


def _too_sure(build: Build, number: int, given: Feed, run: Run) -> list[str]:
    """Lines about outputs whose errors are many times the estimator's own deviations of them."""
    estimator, program = build.estimators[number], build.programs[number]
    if run.states is None or not (given.truth and estimator.covariance_elements):
        return []
    states = {
        program.values[state].name: program.format(state).real(run.states[: len(given), k])
        for k, (state, _) in enumerate(program.states)
    }
    if (own := own_covariance(estimator, states, build.values[number])) is None:
        return []
    lines, units = list[str](), {o.name: o.unit for o in estimator.outputs}
    # An output with the name of a state may be its prediction.
    estimates = {name: values[: len(given)] for name, values in run.outputs.items()} | states
    for k, name in enumerate(own[0]):
        if name not in given.truth or name not in estimates:
            continue
        error = np.abs(estimates[name] - given.truth[name])
        unit = units.get(name, "")
        error = around(error, PERIODS[unit]) if unit in PERIODS else error
        variance = own[1][:, k, k]
        known = given.counts & np.isfinite(error) & (variance > 0.0)
        times = np.median(error[known] / np.sqrt(variance[known])) if known.any() else 0.0
        if times > _SURE:
            lines.append(
                f"{name}: its error against {name}_true is typically {times:.0f} times its own "
                "standard deviation; compare signs, units and times of the model with the log's"
            )
    return lines


def _pieces(blocks: Sequence[Feed], rows: int, anew: bool) -> Iterator[tuple[list[Feed], bool]]:
    """Pieces of at most so many rows, and whether each begins from the initial states.

    ``anew`` says it of the first. The others do where the logs restart.
    """
    longest = max(map(len, blocks))
    starts = {*np.flatnonzero(max(blocks, key=len).restarts).tolist()}
    for block in blocks:
        own = {*np.flatnonzero(block.restarts).tolist()}
        wanted = "the same rows for all estimators, which take turns on the core"
        good = own == {k for k in starts if k < len(block)}
        require(good, "column restart", wanted, "other rows", "check them one by one")
    for start, stop in pairwise([*sorted({*starts, *range(0, longest, rows)}), longest]):
        yield [block.rows(start, stop) for block in blocks], start in starts or (anew and not start)
