"""What a check found: a verdict for each level, and all of them for one estimator on one record."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.sim.answer import Answer, JsonObject, plain
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.textbook import textbook_line
from boresight.sim.compare.verdict import Accuracy
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level, Run
from boresight.sim.records.feed import Feed

__all__ = ["CheckResult", "LevelResult", "compare", "verdict"]


@dataclass(frozen=True)
class LevelResult:
    """One level's verdict.

    ``n_mismatch`` counts the updates, of ``n_total``, whose outputs, states or saturation flag
    differ, and ``first_wrong`` is the first of them. ``error`` says why a level did not run, or
    why its run proves nothing: then there are no counts (None). Cycles are None for levels without
    a clock.
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
            return f"cycles predicted {self.cycles_predicted}, counted {self._cycles}"
        if not self.interval_min == self.interval_predicted == self.interval_max:
            return f"interval predicted {self.interval_predicted}, counted {self._intervals}"
        return ""

    @property
    def _cycles(self) -> str:
        return _span(self.cycles_min, self.cycles_max)

    @property
    def _intervals(self) -> str:
        return _span(self.interval_min, self.interval_max)

    def line(self) -> str:
        """One line for people; what `error` says stands in the verdict, once for all levels."""
        name = f"{self.level:8s} {self.simulator:12s}"
        if self.error:
            return f"{name} FAILED"
        text = f"{name} [{self.n_mismatch}/{self.n_total}] mismatches"
        if self.cycles_predicted is not None:
            text += (
                f"   cycles predicted {self.cycles_predicted}, counted {self._cycles}"
                f"; interval predicted {self.interval_predicted}, counted {self._intervals}"
            )
        return f"{text}   {self.seconds:.1f} s" + (
            f"\n         {self.divergence}" if self.divergence else ""
        )


def _span(least: int | None, most: int | None) -> str:
    return f"{least}" if least == most else f"{least}..{most}"


def compare(level: Level, run: Run, wanted: Run, seconds: float = 0.0) -> LevelResult:
    """A level by its words, flags, states if it shows them, and cycles if it has a clock.

    ``wanted`` is the interpreter's run, of at least as many records.
    """
    assert run.words is not None and wanted.words is not None
    assert run.saturated is not None and wanted.saturated is not None
    n = len(run.words)
    wrong = (run.words != wanted.words[:n]).any(axis=1) | (run.saturated != wanted.saturated[:n])
    if run.states is not None and wanted.states is not None:
        wrong |= (run.states != wanted.states[:n]).any(axis=1)
    cycles: dict[str, Any] = {}
    if (plan := level.schedule) is not None:
        assert run.latency_cycles is not None and run.interval_cycles is not None
        counted = run.latency_cycles[:, : plan.urgent].max(axis=1)
        cycles = {
            "cycles_predicted": plan.latency,
            "cycles_min": int(counted.min()),
            "cycles_max": int(counted.max()),
            "interval_predicted": plan.interval,
            "interval_min": int(run.interval_cycles.min()),
            "interval_max": int(run.interval_cycles.max()),
        }
    first = int(wrong.argmax()) if wrong.any() else None
    return LevelResult(
        level.name,
        level.tool,
        None if run.fault else n,
        None if run.fault else int(wrong.sum()),
        seconds,
        error=run.fault,
        first_wrong=first,
        **cycles,
    )


@dataclass(frozen=True, eq=False)
class CheckResult(Answer):
    """All levels on one record, and the float comparison that goes with them.

    Attributes
    ----------
    build, number
        What was checked: which of its estimators.
    given : Feed
        What it ran on.
    levels : tuple of LevelResult
    accuracy : Accuracy
    fixed, floating : Run
        The interpreter's, with which every level was compared, and float64's.
    textbook : tuple of Difference
        Float64 beside `Estimator.textbook`, where there is one.
    """

    build: Build = field(repr=False)
    number: int
    given: Feed = field(repr=False)
    levels: tuple[LevelResult, ...]
    accuracy: Accuracy
    fixed: Run = field(repr=False)
    floating: Run = field(repr=False)
    textbook: tuple[Difference, ...] = ()

    @property
    def estimator(self) -> str:
        """Name of the estimator."""
        return self.build.estimators[self.number].name

    @property
    def failures(self) -> list[str]:
        """What is wrong, one line each; empty if `good`."""
        levels = [f"{x.level} in {x.simulator}: {x.failure}" for x in self.levels if x.failure]
        book = [] if self._near_textbook else [textbook_line(self.textbook)]
        none = [] if self.levels else ["no level was run"]
        return [*levels, *self.accuracy.faults(), *book, *none]

    @property
    def _near_textbook(self) -> bool:
        return all(d.good for d in self.textbook)

    @property
    def exact(self) -> bool:
        """Every level ran and equals the integer model."""
        return bool(self.levels) and all(level.good for level in self.levels)

    @property
    def good(self) -> bool:
        """Every level is exact, and fixed point is as near to float64 as its author accepts."""
        return self.exact and self.accuracy.good and self._near_textbook

    def lines(self) -> list[str]:
        """Everything, for people."""
        return [
            f"{self.estimator} on {self.given.record.name}, {self.build.config}, "
            f"W = {self.build.word}",
            *(f"  {level.line()}" for level in self.levels),
            *(f"  {text}" for text in self.accuracy.lines()),
            *([f"  {textbook_line(self.textbook)}"] if self.textbook else []),
            *(f"  warning: {text}" for text in self.given.warnings),
        ]

    def __str__(self) -> str:
        return "\n".join((*self.lines(), verdict([self])))

    def _shown(self) -> JsonObject:
        data = self.to_json()
        near = data.pop("accuracy")
        assert isinstance(near, dict)
        return {**data, "from float64": near["outputs"]}

    def to_json(self) -> JsonObject:
        """Plain data for --json."""
        return {
            "estimator": self.estimator,
            "log": self.given.record.name,
            "config": self.build.config,
            "word": self.build.word,
            "good": self.good,
            "exact": self.exact,
            "accuracy": plain(self.accuracy),
            "textbook": [d.to_json() for d in self.textbook],
            "warnings": list(self.given.warnings),
            "verification": plain(
                [
                    {**dataclasses.asdict(x), "good": x.good, "failure": x.failure}
                    for x in self.levels
                ]
            ),
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
