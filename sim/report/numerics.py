"""Format, range, headroom and rounding of every value of a program, on logs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from boresight.model.lowering.graph import declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Overflow, Program, Value
from boresight.sim.compare.diagnosis import headroom_bits, wasted_bits
from boresight.sim.compare.difference import Spread
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import KINDS, Traced, twins


class Observed:
    """One program on the logs of its checks.

    By the number of a value: ``nodes``, ``lines`` ("file.py, line 41"), ``errors`` of rounding on
    all logs, values that are ``wasted``; its ``extremes``, the smallest and the largest word, each
    with plus or minus the number of the first of ``logs`` that has it, and the sample; the same
    words in its unit, ``reached``; ``saturations``, updates in which it was clamped.
    """

    def __init__(self, program: Program, checks: Sequence[CheckResult]) -> None:
        self.program = program
        build, number = checks[0].build, checks[0].number
        estimator = build.estimators[number]
        self.traced, self.nodes = Traced.of(build, number), build.nodes[number]
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
        self.errors: dict[int, Spread] = {}
        for check in checks:
            previous: IntArray | None = None
            for columns, fixed, _ in check.parts():
                assert fixed.states is not None
                words = columns.words(program)
                rows = words, fixed.states, previous
                for twin in twins(self.traced, *rows, anew=columns.restarts):
                    for n in (op.dest for op in program.ops if op.dest in self.nodes):
                        error, size = twin.deviation(n)
                        finite = np.isfinite(error) & np.isfinite(size)
                        if finite.any():
                            self.errors.setdefault(n, Spread()).add(error, finite, 0)
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
        wasted = wasted_bits(self.traced, self.reached)
        self.wasted = {w.number: w for w in wasted}

    def name(self, n: int) -> str:
        """What its author calls a value, or the kind of expression; its line stands beside it."""
        node = self.nodes.get(n)
        if node is None or self.program.values[n].kind is not Kind.OP or node.name or node.title:
            return declared_name(self.program, self.nodes, n)
        return KINDS.get(node.kind, node.kind)

    def figures(self, n: int, mode: Overflow | None) -> dict[str, Any]:
        """Figures of a value, whose overflow is handled by ``mode``."""
        value, format = self.program.values[n], self.program.format(n)
        headroom, wasted, error = None, self.wasted.get(n), self.errors.get(n)
        if value.kind is not Kind.PARAM and mode is not Overflow.WRAP:
            headroom = round(headroom_bits(self.program, n, self.reached[n]), 2)
        ends = [
            {"value": _digits(x), "log": self.logs[abs(log)], "sample": sample}
            for x, (_, log, sample) in zip(self.reached[n], self.extremes[n], strict=True)
        ]
        saturations = int(self.saturations[n])
        state = "saturated" if saturations else _state(value, mode, self.reached[n], headroom)
        return {
            "observed_min": ends[0],
            "observed_max": ends[1],
            "headroom_bits": headroom,
            "wasted_bits": None if wasted is None else wasted.bits,
            "advice": None if wasted is None else wasted.cure,
            "error_max": None if error is None else _digits(error.largest),
            "error_rms": None if error is None else _digits(error.rms),
            "error_lsb": None if error is None else round(error.largest / format.lsb, 2),
            "saturations": saturations,
            "state": state,
        }


def _digits(x: float) -> float:
    return float(f"{x:.7g}")


def _state(
    value: Value, mode: Overflow | None, reached: tuple[float, float], headroom: float | None
) -> str:
    """State of a value that did not saturate, in one word, for the colour in the report."""
    if mode is Overflow.WRAP:
        return "wraps"
    if headroom is None or headroom >= 1.0:
        return "ok"
    if mode is Overflow.CLIP:
        return "clips"  # on purpose
    if value.kind is Kind.INPUT:
        return "tight"
    # A range that arithmetic proves may be used to its end, and so may one whose end is reached
    # exactly, unclamped (a flag, the cosine of 0); any other declared range is a claim.
    end = value.low if -reached[0] > reached[1] else value.high
    is_claim = value.range_source.startswith("declared") and end not in reached
    return "tight" if is_claim else "ok"


def numerics_section(observed: Observed) -> list[dict[str, Any]]:
    """A row for every value except constants, in the order of the program.

    ``output`` names the output that the value is, or null; ``line`` is where its author wrote it.
    ``headroom_bits`` says how often the largest word observed could double within the format; null
    for parameters and for values that wrap. ``wasted_bits`` are lost because of the value's own
    range, and ``advice`` says how to gain them (`sim.compare.diagnosis`). ``error_max`` and
    ``error_rms`` are how far rounding, tables and constants moved the value in one update, in its
    unit, against its float64 twin, which reads the same words; ``error_lsb`` is the largest in its
    last bits. They are null where it is no operation of its author's. ``overflow`` of a state is
    that of the value that replaces it. ``state`` is "saturated", "tight" (less than one bit left in
    a range that nothing proves), "wraps", "clips" (both by design) or "ok".
    """
    program = observed.program
    overflow = {op.dest: op.overflow for op in program.ops}
    next_value = dict(program.states)
    outputs: dict[int, list[str]] = {}
    units: dict[int, str] = {}
    for name, number in zip(program.output_names, program.outputs, strict=True):
        outputs.setdefault(number, []).append(name)
    for port, number in zip(program.ports, program.outputs, strict=False):
        units.setdefault(number, port.unit)
    rows = []
    for n, value in enumerate(program.values):
        mode = overflow.get(next_value.get(n, n))
        if value.kind is not Kind.CONST and mode is not Overflow.RANGE:
            rows.append(
                {
                    "signal": observed.name(n),
                    "kind": value.kind.value,
                    "output": ", ".join(outputs[n]) if n in outputs else None,
                    "unit": value.unit or units.get(n, ""),
                    "format": str(program.format(n)),
                    "overflow": mode.value if mode is not None else None,
                    "min": _digits(value.low),
                    "max": _digits(value.high),
                    "range_source": value.range_source,
                    "line": observed.lines.get(n),
                    "format_min": _digits(program.format(n).min),
                    "format_max": _digits(program.format(n).max),
                    **observed.figures(n, mode),
                }
            )
    return rows
