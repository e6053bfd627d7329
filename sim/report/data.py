"""The report as data: everything known about one core.

What is not known is null and named in ``warnings``; nothing is filled in. What failed is in
``verdict``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.schedule.slots import Schedule, Slot
from boresight.gateware.synthesis.family import Device
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.words.program import Kind
from boresight.sim.compare.results import CheckResult, LevelResult
from boresight.sim.report.accuracy import accuracy_section
from boresight.sim.report.numerics import Observed, numerics_section
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
    "firmware.ram_bytes": Figure("C, memory", "area", "bytes"),
    "firmware.table_bytes": Figure("C, tables", "area", "bytes"),
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
    uses_table = any(t.coefficient is not None for op in program.ops for t in op.terms)
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
        "firmware": {
            "ram_bytes": 4 * (len(program.of_kind(Kind.PARAM)) + len(program.states)),
            "table_bytes": 4 * len(program.table_memory) if uses_table else 0,
        },
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
        "source": "cycles: the schedule"
        + (", and counted in simulation" if smallest is not None else "")
        + (f"; clock: {area.source}" if area is not None else ""),
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


def _kind(schedule: Schedule, slot: Slot) -> str:
    if slot.op is None:
        return "emit"
    if slot.term is None:
        return "capture"
    term = schedule.program.ops[slot.op].terms[slot.term]
    return "multiply-add" if term.coefficient is None else "function table"


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
    """Totals, source ``lines`` with most slots, and the chart.

    ``emitted`` are the slots that only send an output. In ``chart``, ``slots`` are
    [cycle, lane, kind, op], ``gets`` [cycle, name] and ``outputs`` [cycle of the emit slot,
    name, latency].
    """
    s = core.schedule
    names = [v.name for v in s.program.values]
    slots = [[x.cycle, x.lane, _kind(s, x), x.op] for x in s.slots]
    return {
        "lanes": s.machine.lanes,
        "ops_total": len(core.program.ops),
        "copies": len(s.program.ops) - len(core.program.ops),
        "slots_total": len(slots),
        "cycles": s.length,
        "lines": _by_line(core, lines),
        "emitted": sum(x.op is None for x in s.slots),
        "chart": {
            "slots": slots,
            "gets": [[c, names[n]] for c, n in zip(s.gets, s.program.inputs, strict=True)],
            "outputs": [
                [x.cycle, s.program.output_names[x.emit], s.latencies[x.emit]]
                for x in s.slots
                if x.emit is not None
            ],
        },
    }
