"""The report as data: everything known about one core.

What is not known is null and named in ``warnings``; nothing is filled in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core
from boresight.gateware.synthesis.family import Device
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.words.program import Kind, Program
from boresight.sim.baseline import Figure
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import authors_name
from boresight.sim.report.accuracy import accuracy_section
from boresight.sim.report.numerics import numerics_section
from boresight.sim.report.observed import Observed
from boresight.sim.report.schedule import schedule_section
from boresight.sim.report.timing import CLOCK_MHZ, timing_section

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
    "digest": Figure("program", "identity"),
}
_IDENTITY = {name: Figure(name, "same") for name in ("design", "config", "word")}
#: Figures that are judged, by their place in a report of one program, and of several.
JUDGED = {
    f"{of}{place}": figure
    for of in ("", "programs.*.")
    for place, figure in (_FIGURES | _IDENTITY).items()
}

Warn = Callable[[str], None]


def report_data(
    core: Core,
    *checks: CheckResult,
    area: Mapped | Routed | None = None,
    grade: int = 2,
    device: Device = TARGETS["xc6slx9"].device,
) -> dict[str, Any]:
    """Build the report of a core's program at hand.

    Parameters
    ----------
    checks : CheckResult
        Of that program, one for each log: verdicts, errors. On their records ranges are observed;
        on the first one the rate of the C is measured.
    area : Mapped or Routed, optional
        Area and clock.
    grade, device
        The target.

    Returns
    -------
    dict
        Plain JSON values.

    Raises
    ------
    ValueError
        If a check belongs to another program.
    """
    program = core.program
    warnings: list[str] = []
    warn = warnings.append
    if area is None:
        warn("resources and clock: not known, no synthesis was run")
    observed = Observed(program, checks) if checks else None
    if observed is None:
        warn("numerics: no log was run, ranges are not observed")
    else:
        count = observed.saturations
        if count.any():
            named = (authors_name(program, observed.nodes, int(n)) for n in np.flatnonzero(count))
            warn(f"numerics: {count.sum()} saturations, in {', '.join(dict.fromkeys(named))}")
    levels = [level for check in checks for level in check.levels]
    return {
        "design": program.name,
        "config": core.machine.name,
        "word": program.arithmetic.word,
        "digest": program.digest,
        "identity": core.identity,
        "verdict": _verdict(checks),
        "target": {"device": device.name, "speed": f"-{grade}", "clock_mhz": CLOCK_MHZ},
        "verification": _verification(checks, warn),
        "timing": timing_section(core, area, levels, grade, warn, _rate(checks)),
        "resources": _resources(area, device),
        "schedule": schedule_section(core, {} if observed is None else observed.lines),
        "numerics": numerics_section(program, observed),
        "profile": _profile(checks),
        "accuracy": accuracy_section(checks, warn),
        "firmware": _firmware(program),
        "observed": None if observed is None else observed.summary,
        "warnings": warnings,
    }


def _verdict(checks: Sequence[CheckResult]) -> dict[str, Any]:
    """Whether all checks are good, and their failures, with the log where there are several."""
    several = len(checks) > 1
    return {
        "good": all(check.good for check in checks) if checks else None,
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


def _profile(checks: Sequence[CheckResult]) -> dict[str, Any] | None:
    """Where formats come from beside intervals; None: nowhere."""
    profiles = [check.build.estimators[check.number].profile for check in checks]
    if not profiles or (profile := profiles[0]) is None:
        return None
    return {"file": profile.place, "logs": list(profile.logs), "formats": len(profile.ranges)}


def _verification(checks: Sequence[CheckResult], warn: Warn) -> list[dict[str, Any]]:
    """A row for each level on each log."""
    levels = [(check.given.record.name, level) for check in checks for level in check.levels]
    for _, x in levels:
        if not x.good:
            warn(f"verification: {x.level} ({x.simulator}) failed: {x.failure}")
    if not levels:
        warn("verification: not run")
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
        "units": {key: device.unit(name) for key, name in names.items()},
        "more": {key: n for key, n in usage.items() if key not in names.values()},
        "source": f"estimate: cells of the netlist by {tool_of(mapped)}, before packing"
        if mapped is not None
        else None,
        "command": mapped.command if mapped is not None else None,
    }


def tool_of(mapped: Mapped) -> str:
    """Name and version of the synthesis tool, without how it was built."""
    name, _, build = mapped.version.partition(" (")
    return f"{name} ({build.split(',')[0].rstrip(')')})" if build else name


def _firmware(program: Program) -> dict[str, Any]:
    """Size of the emitted C."""
    files = {
        name: {"lines": len(text.splitlines()), "bytes": len(text.encode())}
        for name, text in emit_c(program).items()
    }
    n_words = len(program.of_kind(Kind.PARAM)) + len(program.states)
    uses_table = any(t.coefficient is not None for op in program.ops for t in op.terms)
    return {
        "files": files,
        "lines": sum(f["lines"] for f in files.values()),
        "bytes": sum(f["bytes"] for f in files.values()),
        "ram_bytes": 4 * n_words,
        "table_bytes": 4 * len(program.table_memory) if uses_table else 0,
    }
