"""A check: every level on the same records, bit by bit and cycle by cycle, and against float64."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from boresight.disk.output import OutputFile
from boresight.model.errors import InputError, ToolMissing
from boresight.model.tools.failure import ToolFailed
from boresight.sim.compare.divergence import first_divergence, program_at
from boresight.sim.compare.reproducer import write_reproducer
from boresight.sim.compare.results import CheckResult, LevelResult, compare
from boresight.sim.compare.soundness import check_sound
from boresight.sim.compare.textbook import beside_textbook
from boresight.sim.compare.verdict import judge
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Interpreted
from boresight.sim.levels.level import Level, Run
from boresight.sim.levels.registry import LEVELS
from boresight.sim.records.feed import Feed, feed
from boresight.sim.records.record import Record
from boresight.sim.rtl.simulators import SIMULATORS, SimulationFailed

__all__ = ["EXACT", "USUAL", "Check"]

#: Levels that can be checked.
EXACT = tuple(name for name, level in LEVELS.items() if level.exact)
#: Those that are checked by default.
USUAL = tuple(name for name in EXACT if LEVELS[name].usual)


@dataclass(frozen=True)
class _Attempt:
    """What a level gave for every estimator: runs, or why there are none."""

    kind: type[Level]
    tool: str
    levels: list[Level]
    runs: list[Run]
    seconds: float
    error: str


class Check:
    """The estimators of one core on records, on as many records as wanted: all is built once.

    Parameters
    ----------
    build : Build
        Estimators in one core; where they are several, they take turns on the RTL.
    levels : sequence of str, optional
        Which of `EXACT`; `USUAL` by default. The integer interpreter, with which each is
        compared, and float64 run in any case.
    simulator : str, optional
        Verilator or Icarus; by default Verilator, and Icarus too (not all updates) where it is.
    progress : callable, optional
        Told what runs.

    Raises
    ------
    InputError
        Unknown level or simulator.
    """

    def __init__(
        self,
        build: Build,
        *,
        levels: Sequence[str] = USUAL,
        simulator: str | None = None,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        for where, found, known in (
            *(("levels", level, EXACT) for level in levels),
            *([("simulator", simulator, SIMULATORS)] if simulator is not None else []),
        ):
            if found not in known:
                raise InputError.at(
                    where,
                    wanted=f"one of {', '.join(known)}",
                    found=repr(found),
                    fix="choose one of these",
                )
        self.build, self.levels, self.simulator = build, levels, simulator
        self.progress = progress or (lambda text: None)
        self._sound = False  # until the first records have been looked at
        self._made: dict[tuple[type[Level], str | None], list[Level]] = {}

    def run(self, *records: Record, reproducer: OutputFile | None = None) -> list[CheckResult]:
        """Run everything.

        Parameters
        ----------
        records : Record
            One for all estimators, or one for each of them; they may differ in length.
        reproducer : OutputFile, optional
            Where to write a reproducer of the first mismatch.

        Returns
        -------
        list of CheckResult
            For each estimator.

        Raises
        ------
        InputError
            A record that does not feed its estimator, or what no core could compute right
            (`sim.compare.soundness`).
        ToolMissing
            There is no C compiler.
        """
        estimators = self.build.estimators
        own = records * len(estimators) if len(records) == 1 else records
        feeds = [
            feed(e, record, linked=self.build.links[k])
            for k, (e, record) in enumerate(zip(estimators, own, strict=True))
        ]
        for text in {text: None for rows in feeds for text in rows.warnings}:
            self.progress(f"warning: {text}")
        if not self._sound:
            check_sound(self.build, [rows.inputs for rows in feeds])
            self._sound = True
        self._say("float64", feeds)
        floating = CompiledFloat.run_together(
            self._levels(CompiledFloat), [g.inputs for g in feeds]
        )
        attempts = [
            self._attempt(LEVELS[name], tool, feeds)
            for name in self.levels
            if name != Interpreted.name
            for tool in LEVELS[name].tools_of_check(self.simulator)
        ]
        judges, fixed, seconds = self._interpret(attempts, feeds)
        results = []
        for k, (rows, wanted, reference) in enumerate(zip(feeds, fixed, floating, strict=True)):
            levels = [self._judged(x, k, rows, wanted, reproducer) for x in attempts]
            if Interpreted.name in self.levels or wanted.fault:
                levels.insert(0, compare(judges[k], wanted, wanted, seconds))
            accuracy = judge(self.build, k, rows.inputs, wanted, reference, rows.clamped)
            book, remarks = beside_textbook(self.build, k, rows.inputs, reference)
            for text in remarks:
                self.progress(f"warning: {text}")
            given = dataclasses.replace(rows, warnings=(*rows.warnings, *remarks))
            results.append(
                CheckResult(self.build, k, given, tuple(levels), accuracy, wanted, reference, book)
            )
        return results

    def _levels(self, kind: type[Level], tool: str | None = None) -> list[Level]:
        """A level for each estimator, made once."""
        if (kind, tool) not in self._made:
            numbers = range(len(self.build.estimators))
            self._made[kind, tool] = [kind(self.build, k, tool) for k in numbers]
        return self._made[kind, tool]

    def _say(self, what: str, feeds: Sequence[Feed], most: int | None = None) -> None:
        count = sum(len(g.inputs[:most]) for g in feeds)
        turns = f" of {len(feeds)} programs" if len(feeds) > 1 else ""
        self.progress(f"{what}, {count} updates{turns}")

    def _attempt(self, kind: type[Level], tool: str, feeds: Sequence[Feed]) -> _Attempt:
        start, error = time.perf_counter(), ""
        levels: list[Level] = []
        runs: list[Run] = []
        try:
            levels = self._levels(kind, tool)
            most = levels[0].most
            self._say(f"{kind.name} in {tool}", feeds, most)
            runs = kind.run_together(levels, [g.inputs[:most] for g in feeds])
        except (ToolMissing, ToolFailed, SimulationFailed) as failed:
            error = str(failed).strip().splitlines()[0]
        seconds = time.perf_counter() - start
        return _Attempt(kind, tool, levels, runs, seconds, error)

    def _interpret(
        self, attempts: Sequence[_Attempt], feeds: list[Feed]
    ) -> tuple[list[Level], list[Run], float]:
        """The interpreter's runs, from the states that another level has shown if any has.

        What one estimator reads of another is in ``feeds`` then.
        """
        shown = next((x.runs for x in attempts if x.runs and x.runs[0].states is not None), None)
        self._say("integer interpreter", feeds)
        start, runs = time.perf_counter(), dict[int, Run]()
        judges, counts = self._levels(Interpreted), [len(rows) for rows in feeds]
        for k in self.build.order:
            judge, outputs = judges[k], {n: run.outputs for n, run in runs.items()}
            inputs = self.build.filled(k, feeds[k].inputs, outputs, counts)
            feeds[k] = dataclasses.replace(feeds[k], inputs=inputs)
            judge.shown = None if shown is None else shown[k].states
            runs[k] = judge.run_anew(inputs)
        seconds = time.perf_counter() - start
        return judges, [runs[k] for k in range(len(judges))], seconds

    def _judged(
        self, tried: _Attempt, k: int, columns: Feed, wanted: Run, reproducer: OutputFile | None
    ) -> LevelResult:
        """One level's verdict on one estimator: on a mismatch with the first value that differs."""
        if tried.error:
            kind, seconds = tried.kind, tried.seconds
            return LevelResult(kind.name, tried.tool, None, None, seconds, error=tried.error)
        level = tried.levels[k]
        result = compare(level, tried.runs[k], wanted, tried.seconds)
        if (step := result.first_wrong) is None:
            return result
        assert wanted.states is not None
        words = columns.words(level.program)
        divergence = first_divergence(level, columns.inputs, words, wanted.states, step)
        many = len(tried.levels)
        rest = f"with {many} programs in turns" if many > 1 else "all values equal"
        text = (
            str(divergence) if divergence else f"{level.name}: outputs differ, step {step}, {rest}"
        )
        if reproducer is not None and not reproducer.written:
            at_step = program_at(level.program, wanted.states, step)
            write_reproducer(
                reproducer, at_step, words[step], step, config=self.build.config, level=level.name
            )
        return dataclasses.replace(result, divergence=text)
