"""Ranges of every value of a program on logs, and its rounding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from boresight.firmware.build import WordRanges
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node, declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.diagnosis import Wasted, headroom_bits, wasted_bits
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import Rounding, rounding_errors


@dataclass(frozen=True)
class Extreme:
    """A word, with the log and the sample in which it was seen first."""

    word: int
    log: str
    sample: int


@dataclass(frozen=True, eq=False)
class Observed:
    """One program on logs.

    Attributes
    ----------
    program : Program
    logs : sequence of str
        Their names.
    counts : sequence of int
        Updates of each.
    words : int64 (n, n_inputs)
        Input words of the first; of a long one the leading rows.
    ranges : sequence of WordRanges
        Extremes of every value in each, on the C model; states count with the words before each
        update.
    errors : mapping of int to Rounding
        By value number, of all logs.
    nodes : mapping of int to Node
        Traced operation, by value number.
    lines : mapping of int to str
        Source location of a value: "file.py, line 41".
    estimator : Estimator, optional
        Of which the program is.
    """

    program: Program
    logs: Sequence[str]
    counts: Sequence[int]
    words: IntArray
    ranges: Sequence[WordRanges]
    errors: Mapping[int, Rounding]
    nodes: Mapping[int, Node]
    lines: Mapping[int, str]
    estimator: Estimator | None = None

    @classmethod
    def of(cls, program: Program, checks: Sequence[CheckResult]) -> Observed:
        """Observations on the records of checks; ValueError if one was of another program."""
        for check in checks:
            expected, actual = program.digest, check.build.programs[check.number].digest
            if expected != actual:
                raise ValueError(f"check must belong to program {expected[:12]}, not {actual[:12]}")
        first = checks[0]
        nodes, errors = first.build.nodes[first.number], dict[int, Rounding]()
        for check in checks:
            previous: IntArray | None = None
            for columns, fixed, _ in check.parts():
                assert fixed.states is not None
                words = columns.words(program)
                rounding = rounding_errors(program, nodes, words, fixed.states, previous)
                for n, one in rounding.items():
                    errors[n] = one.joined(errors.get(n, Rounding()))
                previous = fixed.states[-1]
        estimator = first.build.estimators[first.number]
        declared = {
            (kind, d.name): d.line
            for kind in (Kind.INPUT, Kind.PARAM, Kind.STATE)
            for d in getattr(estimator, f"{kind}s")
        }
        lines = {
            n: declared.get((v.kind, declared_name(program, nodes, n)), "")
            for n, v in enumerate(program.values)
        }
        lines |= {n: node.line for n, node in nodes.items() if node.line}
        return cls(
            program,
            [c.given.record.name for c in checks],
            [c.rows for c in checks],
            first.given.words(program),
            [c.accuracy.ranges for c in checks if c.accuracy.ranges is not None],
            errors,
            nodes,
            {n: line for n, line in lines.items() if line},
            estimator,
        )

    def extremes(self, value: int) -> tuple[Extreme, Extreme]:
        """Smallest and largest word that was seen."""
        pairs = list(zip(self.ranges, self.logs, strict=True))
        lows = [Extreme(int(r.low[value]), log, int(r.low_at[value])) for r, log in pairs]
        highs = [Extreme(int(r.high[value]), log, int(r.high_at[value])) for r, log in pairs]
        return min(lows, key=lambda e: e.word), max(highs, key=lambda e: e.word)

    def reached(self, value: int) -> tuple[float, float]:
        """Smallest and largest word that was seen, in the value's unit."""
        real = self.program.format(value).real
        low, high = self.extremes(value)
        return float(real(low.word)), float(real(high.word))

    def saturations(self, value: int) -> int:
        """Updates of all logs in which it was clamped."""
        return sum(int(r.saturations[value]) for r in self.ranges)

    def headroom_bits(self, value: int) -> float:
        """How often the largest word seen could double before it left the format."""
        return headroom_bits(self.program, value, self.reached(value))

    @cached_property
    def wasted(self) -> dict[int, Wasted]:
        """Values that waste bits because of their own range, the worst first."""
        if self.estimator is None:
            return {}
        reached = {n: self.reached(n) for n in range(len(self.program.values))}
        wasted = wasted_bits(self.estimator, self.program, self.nodes, reached)
        return {w.number: w for w in wasted}

    @property
    def summary(self) -> str:
        """Numbers of updates, and their logs."""
        counts = zip(self.counts, self.logs, strict=True)
        return ", ".join(f"{count} updates of {log}" for count, log in counts)
