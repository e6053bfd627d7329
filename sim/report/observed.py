"""Ranges of every value of a program on logs, and its rounding."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from boresight.model.lowering.graph import declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.diagnosis import wasted_bits
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import Rounding, Traced, twins


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
    extremes : list of (int, int, int) pairs
        By value number, its smallest and largest word, each with plus or minus the number of the
        first of ``logs`` that has it, and the sample.
    reached : dict of int to (float, float)
        The same words in the value's unit.
    saturations : int64 (n_values,)
        Updates of all logs in which a value was clamped.
    """

    def __init__(self, program: Program, checks: Sequence[CheckResult]) -> None:
        for check in checks:
            expected, actual = program.digest, check.build.programs[check.number].digest
            if expected != actual:
                raise ValueError(f"check must belong to program {expected[:12]}, not {actual[:12]}")
        build, number = checks[0].build, checks[0].number
        estimator = build.estimators[number]
        self.nodes = build.nodes[number]
        self.summary = ", ".join(f"{c.rows} updates of {c.given.record.name}" for c in checks)
        # On the C model; states count with the words before each update.
        ranges = [(c.accuracy.ranges, c.given.record.name) for c in checks if c.accuracy.ranges]
        self.saturations: IntArray = np.sum([r.saturations for r, _ in ranges], axis=0)
        self.extremes = [
            (
                min((int(r.low[n]), k, int(r.low_at[n])) for k, (r, _) in enumerate(ranges)),
                max((int(r.high[n]), -k, int(r.high_at[n])) for k, (r, _) in enumerate(ranges)),
            )
            for n in range(len(program.values))
        ]
        self.logs = [log for _, log in ranges]
        self.reached = {
            n: (float(program.format(n).real(low[0])), float(program.format(n).real(high[0])))
            for n, (low, high) in enumerate(self.extremes)
        }
        self.errors: dict[int, Rounding] = {}
        for check in checks:
            previous: IntArray | None = None
            for columns, fixed, _ in check.parts():
                assert fixed.states is not None
                words = columns.words(program)
                rows = program, self.nodes, words, fixed.states, previous
                for twin in twins(*rows, anew=columns.restarts):
                    for n in (op.dest for op in program.ops if op.dest in self.nodes):
                        error, size = twin.deviation(n)
                        finite = np.isfinite(error) & np.isfinite(size)
                        self.errors.setdefault(n, Rounding()).add(error[finite])
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
        wasted = wasted_bits(Traced(estimator, program, self.nodes), self.reached)
        self.wasted = {w.number: w for w in wasted}
