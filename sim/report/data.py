"""The report as data: everything known about one core.

What is not known is null and named in ``warnings``; nothing is filled in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.synthesis.family import Device
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.words.program import Kind, Program
from boresight.sim.baseline import Figure
from boresight.sim.compare.results import CheckResult, LevelResult
from boresight.sim.compare.twin import authors_name
from boresight.sim.report.accuracy import accuracy_section
from boresight.sim.report.numerics import Observed, numerics_section
from boresight.sim.report.schedule import schedule_section

#: Clock of the target, MHz.
CLOCK_MHZ = 100.0
_AREA = {"lut": "lut", "reg": "ff", "dsp": "dsp"}

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
        "firmware": _firmware(program),
        "warnings": warnings,
    }


def report_data(core: Core, *checks: CheckResult, **given: Any) -> dict[str, Any]:
    """The report of a core's program at hand: `core_data`, and what checks found.

    There is one of that program for each log, with its verdict and errors; on all of them ranges
    are observed. ``given`` are area, grade and device. ValueError: a check is of another program.
    """
    program, observed = core.program, Observed(core.program, checks)
    levels = [level for check in checks for level in check.levels]
    data = core_data(core, levels=levels, rate_hz=_rate(checks), **given)
    warn = data["warnings"].append
    if (count := observed.saturations).any():
        named = (authors_name(program, observed.nodes, int(n)) for n in np.flatnonzero(count))
        warn(f"numerics: {count.sum()} saturations, in {', '.join(dict.fromkeys(named))}")
    return {
        **data,
        "verdict": _verdict(checks),
        "verification": _verification(checks, warn),
        "schedule": schedule_section(core, observed.lines),
        "numerics": numerics_section(program, observed),
        "profile": _profile(checks[0]),
        "accuracy": accuracy_section(checks, warn),
        "observed": observed.summary,
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


def _verdict(checks: Sequence[CheckResult]) -> dict[str, Any]:
    """Whether all checks are good, and their failures, with the log where there are several."""
    several = len(checks) > 1
    return {
        "good": all(check.good for check in checks),
        "failures": [
            f"{check.given.record.name}: {text}" if several else text
            for check in checks
            for text in check.failures
        ],
    }


def _rate(checks: Sequence[CheckResult]) -> float | None:
    """Records a second: of the log that has most, by the median of its steps."""
    steps = [float(np.median(np.diff(c.given.t))) for c in checks if c.given.t is not None]
    return max((1.0 / step for step in steps if step > 0.0), default=None)


def _profile(check: CheckResult) -> dict[str, Any] | None:
    """Where formats come from beside intervals; None: nowhere."""
    if (profile := check.profile) is None:
        return None
    return {"file": profile.place, "logs": list(profile.logs), "formats": len(profile.ranges)}


def _verification(checks: Sequence[CheckResult], warn: Warn) -> list[dict[str, Any]]:
    """A row for each level on each log."""
    levels = [(check.given.record.name, level) for check in checks for level in check.levels]
    for _, x in levels:
        if not x.good:
            warn(f"verification: {x.level} ({x.simulator}) failed: {x.failure}")
    return [{"log": log, **x.to_json()} for log, x in levels]


def _resources(area: Mapped | Routed | None, device: Device) -> dict[str, Any]:
    mapped = area.mapped if isinstance(area, Routed) else area
    usage: Mapping[str, float] = {} if mapped is None else mapped.used
    names = {**_AREA, "blkmem": device.memory}
    counts = {key: usage.get(name) for key, name in names.items()}
    return {
        **counts,
        "percent": {
            key: device.percent(names[key], n) if n is not None else None
            for key, n in counts.items()
        },
        "available": {key: device.capacity(name) for key, name in names.items()},
        "source": f"estimate: cells of the netlist by {tool_of(mapped)}, before packing"
        if mapped is not None
        else None,
    }


def tool_of(mapped: Mapped) -> str:
    """Name and version of the synthesis tool, without how it was built."""
    name, _, build = mapped.version.partition(" (")
    return f"{name} ({build.split(',')[0].rstrip(')')})" if build else name


def _firmware(program: Program) -> dict[str, Any]:
    """Memory of the emitted C."""
    n_words = len(program.of_kind(Kind.PARAM)) + len(program.states)
    uses_table = any(t.coefficient is not None for op in program.ops for t in op.terms)
    table_bytes = 4 * len(program.table_memory) if uses_table else 0
    return {"ram_bytes": 4 * n_words, "table_bytes": table_bytes}
