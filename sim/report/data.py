"""The report as data: everything known about one core, each number with its source.

What is not known is null and named in ``warnings``; nothing is filled in.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.firmware.build import CModel
from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core
from boresight.gateware.synthesis.device import Device
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.spartan6.family import XC6SLX9
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.results import CheckResult
from boresight.sim.report.accuracy import accuracy_section
from boresight.sim.report.against import against_section
from boresight.sim.report.numerics import numerics_section
from boresight.sim.report.observed import Observed
from boresight.sim.report.schedule import schedule_section
from boresight.sim.report.sources import sources, tool_of
from boresight.sim.report.timing import timing_section

__all__ = ["measure_c", "report_data"]

_AREA = {"lut": "lut", "reg": "ff", "dsp": "dsp"}

Warn = Callable[[str], None]


def report_data(
    core: Core,
    *checks: CheckResult,
    area: Mapped | Routed | None = None,
    comparison: bool = False,
    clock_mhz: float = 100.0,
    grade: int = 2,
    device: Device = XC6SLX9,
    widths: Mapping[str, Any] | None = None,
    before: Mapping[str, Any] | None = None,
    command: str | None = None,
) -> dict[str, Any]:
    """Build the report of a core's program at hand.

    Parameters
    ----------
    checks : CheckResult
        Of that program, one for each log: verdicts, errors. On their records ranges are observed;
        on the first one the rate of the C is measured.
    area : Mapped or Routed, optional
        Area and clock.
    comparison : bool
        The record's attitude is another device's estimate, not truth.
    clock_mhz, grade, device
        The target.
    widths : mapping, optional
        `sim.report.widths.width_section` of the first check.
    before : mapping, optional
        Another report, to compare this one with.
    command : str, optional
        The command line that makes this report.

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
    observed = Observed.of(program, checks) if checks else None
    if observed is None:
        warn("numerics: no log was run, ranges are not observed")
    else:
        count = [observed.saturations(n) for n in range(len(program.values))]
        if any(count):
            names = ", ".join(v.name for v, n in zip(program.values, count, strict=True) if n)
            warn(f"numerics: {sum(count)} saturations, in {names}")
    levels = [level for check in checks for level in check.levels]
    data: dict[str, Any] = {
        "design": program.name,
        "config": core.machine.name,
        "word": program.arithmetic.word,
        "digest": program.digest,
        "command": command,
        "verdict": _verdict(checks),
        "target": {"device": device.name, "speed": f"-{grade}", "clock_mhz": clock_mhz},
        "verification": _verification(checks, warn),
        "timing": timing_section(core, area, levels, clock_mhz, grade, warn, _rate(checks)),
        "resources": _resources(area, device),
        "schedule": schedule_section(core, {} if observed is None else observed.lines),
        "numerics": numerics_section(program, observed),
        "profile": _profile(checks),
        "accuracy": accuracy_section(checks, warn, truth=not comparison),
        "firmware": _firmware(program, None if observed is None else observed.words, warn),
        "widths": widths,
        "warnings": warnings,
    }
    data["against"] = None if before is None else against_section(before, data)
    data["sources"] = sources(data, area, "" if observed is None else observed.summary, device)
    return data


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
    return [
        {
            "log": log,
            "level": x.level,
            "simulator": x.simulator,
            "n_total": x.n_total,
            "n_mismatch": x.n_mismatch,
            "reference": x.reference,
            "seconds": round(x.seconds, 3),
            "cycles": None
            if x.cycles_predicted is None
            else {"predicted": x.cycles_predicted, "min": x.cycles_min, "max": x.cycles_max},
            "interval": None
            if x.interval_predicted is None
            else {"predicted": x.interval_predicted, "min": x.interval_min, "max": x.interval_max},
            "good": x.good,
            "failure": x.failure,
            "divergence": x.divergence,
        }
        for log, x in levels
    ]


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
        "units": {key: device.resources[name].unit for key, name in names.items()},
        "more": {key: n for key, n in usage.items() if key not in names.values()},
        "source": f"estimate: cells of the netlist by {tool_of(mapped)}, before packing"
        if mapped is not None
        else None,
        "command": mapped.command if mapped is not None else None,
    }


def _firmware(program: Program, words: IntArray | None, warn: Warn) -> dict[str, Any]:
    """Size of the emitted C, and its rate on these input words."""
    files = {
        name: {"lines": len(text.splitlines()), "bytes": len(text.encode())}
        for name, text in emit_c(program).items()
        if not name.endswith("_host.c")
    }
    n_words = len(program.of_kind(Kind.PARAM)) + len(program.states)
    uses_table = any(t.coefficient is not None for op in program.ops for t in op.terms)
    if words is None:
        warn("firmware: rate of the C not measured")
    rate = {"updates_per_s": None, "source": None} if words is None else measure_c(program, words)
    return {
        "files": files,
        "lines": sum(f["lines"] for f in files.values()),
        "bytes": sum(f["bytes"] for f in files.values()),
        "ram_bytes": 4 * n_words,
        "table_bytes": 4 * len(program.table_memory) if uses_table else 0,
        **rate,
    }


def measure_c(program: Program, words: IntArray, *, seconds: float = 0.05) -> dict[str, Any]:
    """Rate of the C on this computer: the best of repeated runs over the words of a log."""
    model = CModel(program)
    best, total = float("inf"), 0.0
    while total < seconds:
        model.reset()
        start = time.perf_counter()
        model.update(words)
        duration = time.perf_counter() - start
        best, total = min(best, duration), total + duration
    return {
        "updates_per_s": float(f"{len(words) / best:.3g}"),
        "source": f"measured: best run of the C on this computer, one core, gcc "
        f"{' '.join(model.cflags)}, {len(words)} updates",
    }
