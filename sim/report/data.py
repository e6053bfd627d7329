"""The report as data: everything known about one core.

What is not known is null and named in ``warnings``; nothing is filled in. What failed is in
``verdict``.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.synthesis.family import Device
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.estimator import Size
from boresight.model.lowering.graph import declared_name
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Overflow, Program, Value
from boresight.sim.compare.diagnosis import headroom_bits, needs_of, wasted_bits
from boresight.sim.compare.results import CheckResult, LevelResult
from boresight.sim.compare.twin import KINDS, Traced, twins
from boresight.sim.report.accuracy import accuracy_section
from boresight.sim.result import Figure

#: Clock of the target, MHz.
CLOCK_MHZ = 100.0
#: Source lines that are named, at most.
_LINES = 8

#: Figures of a report, by their place, that are judged against an earlier one; see `JUDGED`.
_FIGURES = {
    "timing.latency_cycles_by_output.*": Figure("latency", "cycles", "cycles"),
    "timing.interval_cycles": Figure("interval", "cycles", "cycles"),
    "resources.lut": Figure("LUT", "area"),
    "resources.reg": Figure("registers", "area"),
    "resources.dsp": Figure("DSP", "area"),
    "resources.blkmem": Figure("RAM", "area"),
    "timing.fmax_mhz.*.p75": Figure("clock, slow nets", "clock", "MHz", falls=True),
    "timing.fmax_mhz.*.routed": Figure("clock, routed", "clock", "MHz", falls=True),
    "parameters.*": Figure("value", "parameter"),
    "tolerances.*": Figure("tolerance", "identity"),
    "digest": Figure("program digest", "identity"),
}
_IDENTITY = {name: Figure(name, "same") for name in ("design", "config", "word")}
#: Figures that are judged, by their place in a report of one program, and of several.
JUDGED = {
    f"{of}{place}": figure
    for of in ("", "programs.*.")
    for place, figure in (_FIGURES | _IDENTITY).items()
}

Warn = Callable[[str], None]


def core_data(
    core: Core,
    area: Mapped | Routed | None = None,
    grade: int = 2,
    device: Device = TARGETS["xc6slx9"].device,
    levels: Sequence[LevelResult] = (),
    rate_hz: float | None = None,
) -> dict[str, Any]:
    """What is known of a core's program at hand without a log: plain JSON values.

    ``levels`` counted cycles; ``rate_hz`` are records a second, with which the core is to keep up.
    """
    program, warnings = core.program, list[str]()
    if area is None:
        warnings.append("resources and clock: not known, no synthesis was run")
    return {
        "design": program.name,
        "config": core.machine.name,
        "word": program.arithmetic.word,
        "digest": program.digest,
        "identity": core.identity,
        "target": {"device": device.name, "speed": f"-{grade}", "clock_mhz": CLOCK_MHZ},
        "timing": _timing(core, area, levels, grade, warnings.append, rate_hz),
        "resources": _resources(area, device),
        "warnings": warnings,
    }


def report_data(core: Core, *checks: CheckResult, **given: Any) -> dict[str, Any]:
    """The report of a core's program at hand: `core_data`, and what checks found.

    There is one of that program for each log, with its verdict and errors; on all of them ranges
    are observed. ``given`` are area, grade and device.
    """
    observed = Observed(core.program, checks)
    levels = [(check.given.record.name, level) for check in checks for level in check.levels]
    steps = [float(np.median(np.diff(c.given.t))) for c in checks if c.given.t is not None]
    rate_hz = max((1.0 / step for step in steps if step > 0.0), default=None)
    data = core_data(core, levels=[level for _, level in levels], rate_hz=rate_hz, **given)
    profile = checks[0].profile
    return {
        **data,
        "verdict": {
            "good": all(check.good for check in checks),
            "failures": [
                f"{check.given.record.name}: {text}" if len(checks) > 1 else text
                for check in checks
                for text in check.failures
            ],
        },
        "verification": [{"log": log, **x.to_json()} for log, x in levels],
        "schedule": schedule_section(core, observed.lines),
        "numerics": numerics_section(observed),
        "profile": profile
        and {"file": profile.place, "logs": [*profile.logs], "formats": len(profile.ranges)},
        "accuracy": accuracy_section(checks, data["warnings"].append),
        "observed": ", ".join(f"{c.rows} updates of {c.given.record.name}" for c in checks),
    }


def _timing(
    core: Core,
    area: Mapped | Routed | None,
    levels: Sequence[LevelResult],
    grade: int,
    warn: Warn,
    rate_hz: float | None,
) -> dict[str, Any]:
    """Predicted and counted cycles, the clock, and records a second."""
    s = core.schedule
    update_us = s.latency / CLOCK_MHZ
    completed = [x for x in levels if not x.error]
    smallest = min((x.cycles_min for x in completed if x.cycles_min is not None), default=None)
    largest = max((x.cycles_max for x in completed if x.cycles_max is not None), default=None)
    if smallest is None:
        warn("cycles: predicted by the schedule, not counted in a simulation")
    elif (smallest, largest) != (s.latency, s.latency):
        warn(f"cycles: predicted {s.latency}, counted {smallest} to {largest}")
    if rate_hz is not None and rate_hz * s.interval > CLOCK_MHZ * 1e6:
        warn(
            f"interval: {s.interval} cycles at {CLOCK_MHZ:g} MHz are longer than a record's at "
            f"{rate_hz:g} Hz"
        )
    return {
        "latency_cycles": {"predicted": s.latency, "min": smallest, "max": largest},
        "latency_cycles_by_output": dict(zip(s.program.output_names, s.latencies, strict=True)),
        "interval_cycles": s.interval,
        "update_us": round(update_us, 4),
        "updates_per_s": round(CLOCK_MHZ * 1e6 / s.interval, 1),
        "rate_hz": None if rate_hz is None else float(f"{rate_hz:.6g}"),
        "busy_percent": None
        if rate_hz is None
        else float(f"{rate_hz * s.interval / (CLOCK_MHZ * 1e4):.3g}"),
        **_clock(area, s.latency, grade, warn),
    }


def _clock(area: Mapped | Routed | None, latency: int, grade: int, warn: Warn) -> dict[str, Any]:
    """Clocks, and the time to the urgent outputs at each."""
    clocks: dict[str, float] = {}
    seeds: dict[str, Any] = {}
    if isinstance(area, Routed):
        seeds = {"seeds": {str(run.seed): run.clock_mhz for run in area.runs}}
        clocks = {} if area.clock_mhz is None else {"routed": area.clock_mhz}
    elif area is not None and area.clock is not None:
        clocks = area.clock.by_nets
    if not clocks:
        return {"fmax_mhz": None, "update_us_at_fmax": None}
    for nets, mhz in clocks.items():
        if mhz < CLOCK_MHZ and nets != "routed":
            warn(
                f"clock: the estimate at speed {grade}, {nets} nets, is {mhz:g} MHz, below the "
                f"{CLOCK_MHZ:g} MHz of the target"
            )
    return {
        "fmax_mhz": {f"-{grade}": clocks},
        "update_us_at_fmax": {f"-{grade}": {k: round(latency / f, 3) for k, f in clocks.items()}},
        **seeds,
    }


def _resources(area: Mapped | Routed | None, device: Device) -> dict[str, Any]:
    mapped = area.mapped if isinstance(area, Routed) else area
    usage: Mapping[str, float] = {} if mapped is None else mapped.used
    names = {"lut": "lut", "reg": "ff", "dsp": "dsp", "blkmem": device.memory}
    counts = {key: usage.get(name) for key, name in names.items()}
    source = None
    if mapped is not None:
        tool, _, made = mapped.version.partition(" (")  # without how it was built
        tool += f" ({made.split(',')[0].rstrip(')')})" if made else ""
        source = f"estimate: cells of the netlist by {tool}, before packing"
    return {
        **counts,
        "percent": {
            key: None if n is None else device.percent(names[key], n) for key, n in counts.items()
        },
        "available": {key: device.capacity(name) for key, name in names.items()},
        "source": source,
    }


def _by_line(core: Core, lines: Mapping[int, str]) -> list[dict[str, Any]]:
    """Source lines with most slots; a part of a sum has the line of the sum, a copy has None."""
    s, lines = core.schedule, dict(lines)
    for op in reversed(core.program.ops):
        for part in op.operands() if op.dest in lines else ():
            lines.setdefault(part, lines[op.dest])
    line_of = {v.name: lines.get(n) for n, v in enumerate(core.program.values)}
    ops = [line_of.get(s.program.values[op.dest].name) for op in s.program.ops]
    count = Counter(ops[x.op] for x in s.slots if x.op is not None)
    return [{"line": line, "slots": n} for line, n in count.most_common(_LINES)] if lines else []


def schedule_section(core: Core, lines: Mapping[int, str]) -> dict[str, Any]:
    """Totals, and source ``lines`` with most slots; ``emitted`` slots only send an output."""
    s = core.schedule
    return {
        "lanes": s.machine.lanes,
        "ops_total": len(core.program.ops),
        "copies": len(s.program.ops) - len(core.program.ops),
        "slots_total": len(s.slots),
        "cycles": s.length,
        "busy_percent": round(100.0 * len(s.slots) / (s.machine.lanes * s.length), 1),
        "lines": _by_line(core, lines),
        "emitted": sum(x.op is None for x in s.slots),
    }


class Observed:
    """One program on the logs of its checks.

    By the number of a value: ``nodes``, ``lines`` ("file.py, line 41"), ``errors`` of rounding on
    all logs, values that are ``wasted``; its smallest and largest value, ``reached``;
    ``saturations``, updates in which it was clamped.
    """

    def __init__(self, program: Program, checks: Sequence[CheckResult]) -> None:
        self.program = program
        build, number = checks[0].build, checks[0].number
        estimator = build.estimators[number]
        self.nodes, traced = build.nodes[number], Traced.of(build, number)
        # On the C model; states count with the words before each update.
        ranges = [c.accuracy.ranges for c in checks if c.accuracy.ranges]
        self.saturations: IntArray = np.sum([r.saturations for r in ranges], axis=0)
        low = np.min([r.low for r in ranges], axis=0)
        high = np.max([r.high for r in ranges], axis=0)
        self.reached = {
            n: (float(program.format(n).real(low[n])), float(program.format(n).real(high[n])))
            for n in range(len(program.values))
        }
        #: Largest error, sum of the squares, and number of updates.
        self.errors: dict[int, tuple[float, float, int]] = {}
        for check in checks:
            previous: IntArray | None = None
            for columns, fixed, _ in check.parts():
                assert fixed.states is not None
                words = columns.words(program)
                rows = words, fixed.states, previous
                for twin in twins(traced, *rows, anew=columns.restarts):
                    for n in (op.dest for op in program.ops if op.dest in self.nodes):
                        error, size = twin.deviation(n)
                        error = error[np.isfinite(error) & np.isfinite(size)]
                        largest, squares, count = self.errors.get(n, (0.0, 0.0, 0))
                        largest = max(largest, float(error.max(initial=0.0)))
                        squares += float(np.sum(error**2))
                        self.errors[n] = largest, squares, count + len(error)
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
        needs = dict[Size, float]()
        for c in checks if estimator.sizes else ():
            pieces = ((p.given.inputs, bool(p.given.restarts[0])) for p in c.parts())
            for own, need in needs_of(traced, build.params[number], pieces).items():
                needs[own] = max(need, needs.get(own, 0.0))
        traced = replace(traced, needs=needs)
        self.wasted = {w.number: w for w in reversed(wasted_bits(traced, self.reached))}

    def name(self, n: int) -> str:
        """What its author calls a value, or the kind of expression; its line stands beside it."""
        node = self.nodes.get(n)
        if node is None or self.program.values[n].kind is not Kind.OP or node.name or node.title:
            return declared_name(self.program, self.nodes, n)
        return KINDS.get(node.kind, node.kind)


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
        if value.kind is Kind.CONST or mode is Overflow.RANGE:
            continue
        format, reached = program.format(n), observed.reached[n]
        headroom, wasted = None, observed.wasted.get(n)
        error = rms = lsb = None
        if n in observed.errors:
            largest, squares, count = observed.errors[n]
            error, rms = _digits(largest), _digits(math.sqrt(squares / max(count, 1)))
            lsb = round(largest / format.lsb, 2)
        if value.kind is not Kind.PARAM and mode is not Overflow.WRAP:
            headroom = round(headroom_bits(program, n, reached), 2)
        saturations = int(observed.saturations[n])
        rows.append(
            {
                "signal": observed.name(n),
                "kind": value.kind.value,
                "output": ", ".join(outputs[n]) if n in outputs else None,
                "unit": value.unit or units.get(n, ""),
                "format": str(format),
                "overflow": mode.value if mode is not None else None,
                "min": _digits(value.low),
                "max": _digits(value.high),
                "range_source": value.range_source,
                "line": observed.lines.get(n),
                "format_min": _digits(format.min),
                "format_max": _digits(format.max),
                "observed_min": _digits(reached[0]),
                "observed_max": _digits(reached[1]),
                "headroom_bits": headroom,
                "wasted_bits": None if wasted is None else wasted.bits,
                "advice": None if wasted is None else wasted.cure,
                "error_max": error,
                "error_rms": rms,
                "error_lsb": lsb,
                "saturations": saturations,
                "state": "saturated" if saturations else _state(value, mode, reached, headroom),
            }
        )
    return rows
