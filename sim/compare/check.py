"""A check: every level on the same records, bit by bit and cycle by cycle, and against float64."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise, zip_longest

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import PERIODS, Output
from boresight.model.errors import ToolMissing, require, require_choice
from boresight.model.estimator import Estimator
from boresight.model.tools.external import ToolFailed
from boresight.sim.accuracy.covariance import own_covariance
from boresight.sim.compare.difference import MODULO, TURNS, Differences, apart, turn_notes, unjudged
from boresight.sim.compare.results import (
    CheckResult,
    FoldedClaims,
    LevelResult,
    Part,
    claim_results,
)
from boresight.sim.compare.textbook import Gates, beside_textbook
from boresight.sim.compare.twin import RANGE_SLACK, Traced, check_sound
from boresight.sim.compare.verdict import Judge, Piece
from boresight.sim.levels.build import Build, Level, Run, states_of
from boresight.sim.levels.registry import LEVELS, CompiledFloat, Emitted, Interpreted
from boresight.sim.levels.rtl import Simulated
from boresight.sim.ranges.claims import Examined, examine
from boresight.sim.records.feed import Feed, Feeder
from boresight.sim.records.files import Log
from boresight.sim.records.plausible import estimate_warnings
from boresight.sim.records.record import Record, truth_names
from boresight.sim.rtl.simulators import SIMULATORS, default_simulator

EXACT = tuple(name for name, level in LEVELS.items() if level.exact)  #: Levels that can be checked.
KEPT = 1 << 16  #: Rows of a log that are read at a time, and the leading ones that a result keeps.
_SURE = 10.0  #: Typical error in an estimator's own standard deviations, beyond which it is told.
#: Warning where nothing decides whether rounding is small enough.
_BARE = "no output has a tolerance, so that rounding is not judged; give tolerance=, or --tolerance"
ROWS = 1 << 15  #: Rows that run on a level at a time.


class _Attempt:
    """A level of every estimator, as far as it came."""

    def __init__(self, check: Check, kind: type[Level]) -> None:
        chosen = (check.simulator or default_simulator()) if kind is Simulated else kind.tool
        self.check, self.kind, self.tool = check, kind, chosen
        self.levels: list[Level] = []
        self.results = [LevelResult(kind.name, chosen) for _ in check.build.estimators]
        self.seconds, self.error = 0.0, ""
        self._rows = self._pieces = 0

    def advance(self, records: Sequence[FloatArray], anew: bool) -> list[Run]:
        """The next records of each estimator: their runs, if there are any."""
        if self.error:
            return []
        start = time.perf_counter()
        try:
            self.levels = self.check.levels_of(self.kind, self.tool)
            if isinstance(rtl := self.levels[0], Simulated) and rtl.record_limit is not None:
                records = [x[: max(rtl.record_limit - self._rows, 0)] for x in records]
            rows = max(map(len, records))
            self._rows, self._pieces = self._rows + rows, self._pieces + 1
            run = self.kind.run_together
            return run(self.levels, records, anew=anew, seed=self._pieces) if rows else []
        except (ToolMissing, ToolFailed) as failed:
            self.error = str(failed).strip().splitlines()[0]
            return []
        finally:
            self.seconds += time.perf_counter() - start


@dataclass(eq=False)
class _Case:
    """One estimator on its log: what has been seen of it, and what is kept."""

    outputs: Sequence[Output]
    judge: Judge
    folded: FoldedClaims
    gates: Gates
    rows: int = 0
    #: Errors of the interpreter against the true values of the log.
    truth: Differences | None = None
    kept: Feed | None = None  #: the first block of the log.
    pieces: list[Part] = field(default_factory=list)  #: what ran of it.
    clamped: Mapping[str, int] = field(default_factory=dict)
    warnings: dict[str, None] = field(default_factory=dict)
    told: Sequence[str] = ()  #: warnings about the rows so far.

    def add(self, part: Part, anew: bool) -> None:
        """Judge the next rows."""
        given = part.given
        self.clamped, self.told = given.clamped, given.warnings
        self.judge.add(given.inputs, part.fixed, part.floating, anew=anew)
        self.folded.add(given.inputs, anew=anew)
        self.gates.add(given.inputs, anew=anew)
        self.truth = self.truth or Differences(self.outputs, given.truth, judged=False)
        truth = {n: np.where(given.counts, v, np.nan) for n, v in given.truth.items()}
        self.truth.add(part.fixed.outputs, truth)
        if self.kept is not None and self.rows < len(self.kept):
            self.pieces.append(part)
        self.rows += len(given)


class Check:
    """The estimators of one core on records, on as many records as wanted: all is built once.

    Several estimators take turns on the RTL. ``levels`` are some of `EXACT`, by default all; the
    integer interpreter, with which each is compared, and float64 run in any case. ``simulator`` is
    one of `SIMULATORS`; Icarus runs the leading updates only. ``progress`` is told what runs.
    Without ``search``, which takes half a second, no inputs that break claims are looked for.
    Raises InputError for an unknown level or simulator.
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
        self._made: dict[type[Level], list[Level]] = {}
        #: Proofs and searches of the claims of each estimator, made once.
        self._examined: dict[int, list[Examined]] = {}

    def run(self, *logs: Log | Record, rows: int = ROWS) -> list[CheckResult]:
        """Run everything, a piece of ``rows`` of the logs after the other on every level.

        There is one log for all estimators, or one for each; they may differ in length. Returns a
        result for each estimator. Raises InputError for a record that does not feed its estimator,
        or what no core could compute right (`check_sound`); ToolMissing without a C compiler.
        """
        sources = [Log.of(log) for log in logs]
        build = self.build
        cases = [
            _Case(
                estimator.outputs,
                Judge(build, k),
                FoldedClaims(Traced.of(build, k), build.params[k]),
                Gates(build, k),
                warnings=dict.fromkeys(filter(None, [estimator.start_note(build.word)])),
            )
            for k, estimator in enumerate(build.estimators)
        ]
        kinds: list[type[Level]] = [Interpreted, *(LEVELS[name] for name in self.levels)]
        attempts = [_Attempt(self, kind) for kind in dict.fromkeys(kinds)]
        begun = False
        for blocks in self._blocks(sources):
            for case, block in zip(cases, blocks, strict=True):
                case.kept = case.kept or block
            if not begun:
                self._begin(cases, blocks, attempts)
            for piece, anew in _pieces(blocks, rows, not begun):
                self._piece(cases, piece, anew, attempts)
                begun = True
        results = []
        for k, case in enumerate(cases):
            own, *levels = (x.results[k].ended(x.seconds, x.error) for x in attempts)
            if Interpreted.name in self.levels or own.error:
                levels.insert(0, dataclasses.replace(own, reference=True))
            results.append(self._result(k, case, sources, levels))
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
        self, cases: Sequence[_Case], blocks: Sequence[Feed], attempts: Sequence[_Attempt]
    ) -> None:
        """Look at the leading rows, and tell what runs."""
        if not self._made:
            check_sound(self.build, [block.inputs for block in blocks])
        if shortage := self.build.shortage:
            text = f"no core, as compile would make it: {shortage}"
            for case in cases:
                case.warnings[text] = None
        slow = {"icarus": " (slow: --simulator verilator is faster)"}
        names = (f"{x.kind.name} in {x.tool}{slow.get(x.tool, '')}" for x in attempts)
        self.progress(", ".join(["float64", *names]))

    def levels_of(self, kind: type[Level], tool: str | None = None) -> list[Level]:
        """A level for each estimator, made once."""
        if kind not in self._made:
            self._made[kind] = [kind(self.build, k, tool) for k in range(self._count)]
        return self._made[kind]

    def _piece(
        self,
        cases: Sequence[_Case],
        piece: Sequence[Feed],
        anew: bool,
        attempts: Sequence[_Attempt],
    ) -> None:
        """Run a piece on every level, and compare with the first one, the interpreter."""
        records = [rows.inputs for rows in piece]
        floating = CompiledFloat.run_together(self.levels_of(CompiledFloat), records, anew=anew)
        runs = [attempt.advance(records, anew) for attempt in attempts]
        for k, part in enumerate(map(Part, piece, runs[0], floating)):
            if len(part.given):
                for attempt, own in zip(attempts, runs, strict=True):
                    if own:
                        level = attempt.levels[k]
                        attempt.results[k].add(level, own[k], part.fixed, cases[k].rows)
                cases[k].add(part, anew)

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
        self, number: int, case: _Case, sources: Sequence[Log], levels: Sequence[LevelResult]
    ) -> CheckResult:
        given = case.kept
        assert given is not None
        kept = len(given) == case.rows
        parts = partial(iter, case.pieces) if kept else partial(self._parts, number, sources)

        def pieces() -> Iterator[Piece]:
            for part in parts():
                assert part.fixed.states is not None
                yield part.given.inputs, part.fixed.states, part.given.restarts

        accuracy = case.judge.result(case.clamped, pieces)
        reference = Run.joined([part.floating for part in case.pieces])
        anew = np.flatnonzero(given.restarts[1:])
        first = given.rows(0, int(anew[0]) + 1) if len(anew) else given
        book = beside_textbook(self.build, number, first, reference, case.gates)
        run = Run.joined([part.fixed for part in case.pieces])
        estimator, source = self.build.estimators[number], sources[number % len(sources)]
        outputs = {name: values[: len(given)] for name, values in run.outputs.items()}
        known = given.new & ~given.restarts[:, None]
        told = estimate_warnings(estimator, given.inputs, known, outputs)
        near = [accuracy.near_floor] if accuracy.near_floor and accuracy.good else []
        truth = tuple(d for d in case.truth.result() if d.samples) if case.truth else ()
        turned = {d.output for d in truth if d.turned}
        strange = turn_notes(truth) + _strange_truth(estimator, given, turned)
        sure = [] if strange or source.comparison else _too_sure(self.build, number, given, run)
        judged = any(d.tolerance is not None for d in accuracy.differences)
        bare = [] if judged else [_BARE]
        bare += unjudged(estimator.outputs, {d.output for d in truth})
        late = (*book.remarks, *told, *strange, *sure, *near, *bare)
        notes = (*case.told, *case.warnings, *late)
        given = dataclasses.replace(given, clamped=dict(case.clamped), notes=notes, doubts=tuple)
        if self.search and number not in self._examined:
            self.progress(f"stated ranges of {estimator.name}")
            self._examined[number] = examine(Traced.of(self.build, number))
        examined = self._examined.get(number, [])
        claims = claim_results(self.build.programs[number], examined, accuracy)
        return CheckResult(
            self.build,
            number,
            given,
            tuple(levels),
            accuracy,
            run,
            reference,
            book,
            truth,
            source.comparison,
            [*claims, *case.folded.result()],
            case.rows,
            parts,
        )


def _strange_truth(estimator: Estimator, given: Feed, turned: Collection[str]) -> list[str]:
    """Lines about true values that the state of their name cannot have; of ``turned`` none.

    An angle may be given by more than one turn, if the column has a unit.
    """
    lines, names = list[str](), truth_names(given.record)
    units = {o.name: o.unit for o in estimator.outputs}
    for s in estimator.states:
        values = given.truth.get(s.name, np.zeros(0))
        values = values[np.isfinite(values)]
        if not len(values) or units[s.name] != s.unit or s.name in turned:
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
            turns = (s.high - s.low) / TURNS.get(s.unit, math.inf)
            one_turn = 1.0 - RANGE_SLACK <= turns < 1.5
            cures += [] if turn else [MODULO if one_turn else "widen the state"]
            lines.append(
                f"column {column}: {far:.4g} {s.unit or 'without unit'} is beyond the range "
                f"[{s.low:g}, {s.high:g}] of the state {s.name}; {', or '.join(cures)}"
            )
    return lines


def _too_sure(build: Build, number: int, given: Feed, run: Run) -> list[str]:
    """Lines about outputs whose errors are many times the estimator's own deviations of them."""
    estimator = build.estimators[number]
    if run.states is None or not (given.truth and estimator.covariance_elements):
        return []
    states = states_of(build.programs[number], run.states[: len(given)])
    if (own := own_covariance(estimator, states, build.values[number])) is None:
        return []
    lines, units = list[str](), {o.name: o.unit for o in estimator.outputs}
    # An output with the name of a state may be its prediction.
    estimates = {name: values[: len(given)] for name, values in run.outputs.items()} | states
    for k, name in enumerate(own[0]):
        if name not in given.truth or name not in estimates:
            continue
        error = apart(units.get(name, ""), estimates[name], given.truth[name])
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
