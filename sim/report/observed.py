"""Ranges of every value of a program on logs, and its rounding."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from boresight.model.lowering.graph import declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.diagnosis import headroom_bits, wasted_bits
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import Rounding, rounding_errors


class Extreme(NamedTuple):
    """A word, with the log and the sample in which it was seen first."""

    word: int
    log: str
    sample: int


class Observed:
    """One program on the logs of checks.

    Parameters
    ----------
    program : Program
    checks : sequence of CheckResult
        ValueError if one was of another program.

    Attributes
    ----------
    errors : mapping of int to Rounding
        By value number, of all logs.
    nodes : mapping of int to Node
        Traced operation, by value number.
    lines : mapping of int to str
        Source location of a value: "file.py, line 41".
    wasted : mapping of int to Wasted
        Values that waste bits because of their own range, the worst first.
    summary : str
        Numbers of updates, and their logs.
    """

    def __init__(self, program: Program, checks: Sequence[CheckResult]) -> None:
        for check in checks:
            expected, actual = program.digest, check.build.programs[check.number].digest
            if expected != actual:
                raise ValueError(f"check must belong to program {expected[:12]}, not {actual[:12]}")
        build, number = checks[0].build, checks[0].number
        estimator = build.estimators[number]
        self.program, self.nodes = program, build.nodes[number]
        self.summary = ", ".join(f"{c.rows} updates of {c.given.record.name}" for c in checks)
        # On the C model; states count with the words before each update.
        self._ranges = [
            (c.accuracy.ranges, c.given.record.name) for c in checks if c.accuracy.ranges
        ]
        self.errors: dict[int, Rounding] = {}
        for check in checks:
            previous: IntArray | None = None
            for columns, fixed, _ in check.parts():
                assert fixed.states is not None
                words = columns.words(program)
                found = rounding_errors(
                    program, self.nodes, words, fixed.states, previous, columns.restarts
                )
                for n, one in found.items():
                    self.errors[n] = one.joined(self.errors.get(n, Rounding()))
                previous = fixed.states[-1]
        declared = {
            (kind, d.name): d.line
            for kind in (Kind.INPUT, Kind.PARAM, Kind.STATE)
            for d in getattr(estimator, f"{kind}s")
        }
        lines = {
            n: declared.get((v.kind, declared_name(program, self.nodes, n)), "")
            for n, v in enumerate(program.values)
        }
        lines |= {n: node.line for n, node in self.nodes.items() if node.line}
        self.lines = {n: line for n, line in lines.items() if line}
        reached = {n: self.reached(n) for n in range(len(program.values))}
        wasted = wasted_bits(estimator, program, self.nodes, reached)
        self.wasted = {w.number: w for w in wasted}

    def extremes(self, value: int) -> tuple[Extreme, Extreme]:
        """Smallest and largest word that was seen."""
        lows = [Extreme(int(r.low[value]), log, int(r.low_at[value])) for r, log in self._ranges]
        highs = [Extreme(int(r.high[value]), log, int(r.high_at[value])) for r, log in self._ranges]
        return min(lows, key=lambda e: e.word), max(highs, key=lambda e: e.word)

    def reached(self, value: int) -> tuple[float, float]:
        """Smallest and largest word that was seen, in the value's unit."""
        real = self.program.format(value).real
        low, high = self.extremes(value)
        return float(real(low.word)), float(real(high.word))

    def saturations(self, value: int) -> int:
        """Updates of all logs in which it was clamped."""
        return sum(int(r.saturations[value]) for r, _ in self._ranges)

    def headroom_bits(self, value: int) -> float:
        """How often the largest word seen could double before it left the format."""
        return headroom_bits(self.program, value, self.reached(value))
