"""The report as data: everything known about one core, each number with its source.

`report_data` builds the dict that is written as ``report.json`` and that `sim.report.html` shows,
from a core and, where there is one, a check on a log; `assemble` builds it from the single parts.
What is not known is null and named in ``warnings``; nothing is filled in.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from boresight.firmware.build import CFLAGS, CModel
from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core
from boresight.gateware.synthesis.device import XC6SLX9, Device
from boresight.gateware.synthesis.estimate import Estimate
from boresight.gateware.synthesis.timing import NOTE
from boresight.model.estimator import Estimator
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.attitude.ma2014 import BESIDE, CLOCK_MHZ, TIME_US
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record
from boresight.sim.report.accuracy import Replay, accuracy_section
from boresight.sim.report.extremes import Extremes, observe
from boresight.sim.report.numerics import numerics_section
from boresight.sim.report.schedule import schedule_section

if TYPE_CHECKING:
    from boresight.sim.compare.check import CheckResult

__all__ = ["PAPER_US", "assemble", "measure_c", "report_data", "source_of"]

#: Published times of such a filter as software on a soft processor at 100 MHz, by estimator.
PAPER_US = {name: TIME_US[row] for name, row in BESIDE.items()}
_PAPER = (
    "Ma Long et al. (2014), body text and conclusion: float software on a MicroBlaze at "
    "100 MHz in an XC6SLX9"
)

_NETS = {"median": "median", "p75": "upper-quartile"}
_AREA = {"lut": "lut", "reg": "ff", "dsp": "dsp", "blkmem": "ramb16"}

Warn = Callable[[str], None]


def source_of(data: Mapping[str, Any], path: str) -> str | None:
    """Source of the number at ``path`` (keys with dots): that of its nearest named ancestor."""
    sources: Mapping[str, str] = data["sources"]
    parts = path.split(".")
    for k in range(len(parts), 0, -1):
        if ".".join(parts[:k]) in sources:
            return sources[".".join(parts[:k])]
    return None


def _verification(rows: Sequence[Mapping[str, Any]], warn: Warn) -> list[dict[str, Any]]:
    """Rows in one form, whether the cycles stand in a dict or side by side."""
    out: list[dict[str, Any]] = []
    for row in rows:
        given = row.get("cycles") or {}
        cycles = {k: given.get(k, row.get(f"cycles_{k}")) for k in ("predicted", "min", "max")}
        interval = {"predicted": row.get("interval_predicted"), "max": row.get("interval_max")}
        clocked = cycles["predicted"] is not None
        error = str(row.get("error") or "")
        equal = (
            cycles["min"] == cycles["predicted"] == cycles["max"]
            and interval["predicted"] == interval["max"]
        )
        good = not error and row["n_total"] > 0 and row["n_mismatch"] == 0 and equal
        one = {
            "level": row["level"],
            "simulator": row["simulator"],
            "n_total": row["n_total"],
            "n_mismatch": row["n_mismatch"],
            "seconds": round(float(row["seconds"]), 3),
            "cycles": cycles if clocked else None,
            "interval": interval if clocked else None,
            "good": bool(row.get("good", good)) and good,
            "error": error,
            "divergence": str(row.get("divergence") or ""),
        }
        out.append(one)
        if not one["good"]:
            warn(
                f"verification: {one['level']} ({one['simulator']}) failed"
                + (
                    f": {error}"
                    if error
                    else f", {one['n_mismatch']} of {one['n_total']} updates differ"
                    if one["n_mismatch"]
                    else ""
                )
            )
    if not out:
        warn("verification: not run")
    return out


def _counted(rows: Sequence[Mapping[str, Any]], key: str, end: str) -> int | None:
    """Least or largest count over the levels that have a clock and no error."""
    seen = [r[key][end] for r in rows if r[key] and not r["error"] and r[key][end] is not None]
    return (min if end == "min" else max)(seen) if seen else None


def _path(estimate: Estimate, grade: int) -> dict[str, Any] | None:
    """The longest path at the target's grade with slow nets."""
    corner = estimate.corner(grade=grade, nets="p75")
    worst = corner.worst
    if worst is None:
        return None
    return {
        "grade": grade,
        "nets": "p75",
        "delay_ns": worst.delay_ns,
        "logic_ns": worst.logic_ns,
        "net_ns": worst.net_ns,
        "slack_ns": worst.slack_ns,
        "group": worst.group,
        "start": worst.start,
        "end": worst.end,
        "points": [
            {
                "cell": p.cell,
                "type": p.type,
                "net": p.net,
                "fanout": p.fanout,
                "net_ns": p.net_ns,
                "cell_ns": p.cell_ns,
                "total_ns": p.total_ns,
                "guessed": sorted(set(p.keys) & set(corner.guessed)),
            }
            for p in worst.points
        ],
        "guessed": [
            {"name": name, "ns": d.ns, "source": d.source}
            for name, d in sorted(corner.guessed.items())
        ],
    }


def _timing(
    core: Core,
    estimate: Estimate | None,
    rows: Sequence[Mapping[str, Any]],
    clock_mhz: float,
    grade: int,
    warn: Warn,
) -> dict[str, Any]:
    s = core.schedule
    update_us = s.latency / clock_mhz
    paper_us = PAPER_US.get(core.program.name)
    fmax = None
    at_fmax = None
    if estimate is not None:
        corners = {(t.grade, t.nets): t.fmax_mhz for t in estimate.timing}
        fmax = {
            f"-{g}": {nets: corners[g, nets] for h, nets in corners if h == g}
            for g in sorted({g for g, _ in corners})
        }
        at_fmax = {
            f"-{g}": {
                nets: round(s.latency / f, 3) if f else None
                for (h, nets), f in corners.items()
                if h == g
            }
            for g in sorted({g for g, _ in corners})
        }
        for (g, nets), f in corners.items():
            if g == grade and f is not None and f < clock_mhz:
                warn(
                    f"clock: the estimate at grade -{g}, {_NETS.get(nets, nets)} nets, is {f:g} "
                    f"MHz, below the {clock_mhz:g} MHz of the target"
                )
    counted = {end: _counted(rows, "cycles", end) for end in ("min", "max")}
    if counted["min"] is None:
        warn("cycles: predicted by the schedule, not counted in a simulation")
    elif counted["min"] != s.latency or counted["max"] != s.latency:
        warn(f"cycles: predicted {s.latency}, counted {counted['min']} to {counted['max']}")
    return {
        "latency_cycles": {"predicted": s.latency, **counted},
        "latency_cycles_by_output": dict(zip(s.program.output_names, s.latencies, strict=True)),
        "urgent_outputs": list(s.program.output_names[: s.urgent]),
        "interval_cycles": s.interval,
        "interval_cycles_counted": _counted(rows, "interval", "max"),
        "update_us": round(update_us, 4),
        "updates_per_s": round(clock_mhz * 1e6 / s.interval, 1),
        "paper_us": paper_us,
        "paper_cycles": round(paper_us * CLOCK_MHZ) if paper_us is not None else None,
        "speedup": round(paper_us / update_us, 1) if paper_us is not None else None,
        "fmax_mhz": fmax,
        "update_us_at_fmax": at_fmax,
        "critical_path": _path(estimate, grade) if estimate is not None else None,
        "source": "cycles: the schedule, re-proven by its checker"
        + (", and counted in simulation" if counted["min"] is not None else "")
        + (f"; clock: static timing, {NOTE}" if estimate is not None else ""),
    }


def _tool(estimate: Estimate) -> str:
    """Name and version of the synthesis tool, without how it was built."""
    name, _, build = estimate.version.partition(" (")
    return f"{name} ({build.split(',')[0].rstrip(')')})" if build else name


def _resources(estimate: Estimate | None, device: Device) -> dict[str, Any]:
    used: Mapping[str, float] = estimate.area.used() if estimate is not None else {}
    counts = {key: used.get(name) for key, name in _AREA.items()}
    return {
        **counts,
        "percent": {
            key: device.percent(_AREA[key], n) if n is not None else None
            for key, n in counts.items()
        },
        "available": {key: device.capacity(name) for key, name in _AREA.items()},
        "more": {key: n for key, n in used.items() if key not in _AREA.values()},
        "source": f"estimate: cells of the netlist by {_tool(estimate)}, before packing"
        if estimate is not None
        else None,
        "command": estimate.command if estimate is not None else None,
    }


def _firmware(program: Program, measured: Mapping[str, Any] | None, warn: Warn) -> dict[str, Any]:
    files = {
        name: {"lines": len(text.splitlines()), "bytes": len(text.encode())}
        for name, text in emit_c(program).items()
        if not name.endswith("_host.c")
    }
    words = len(program.of_kind(Kind.PARAM)) + len(program.states)
    uses_table = any(t.coefficient is not None for op in program.ops for t in op.terms)
    if measured is None:
        warn("firmware: rate of the C not measured")
    return {
        "files": files,
        "lines": sum(f["lines"] for f in files.values()),
        "bytes": sum(f["bytes"] for f in files.values()),
        "ram_bytes": 4 * words,
        "table_bytes": 4 * len(program.table_memory) if uses_table else 0,
        "updates_per_s": measured["updates_per_s"] if measured is not None else None,
        "source": measured["source"] if measured is not None else None,
    }


def _sources(
    data: Mapping[str, Any],
    estimate: Estimate | None,
    extremes: Extremes | None,
    device: Device,
    verified_by: str,
) -> dict[str, str]:
    """What each part of the report rests on; `source_of` looks a number up."""
    schedule = "schedule: predicted when the core was compiled, re-proven by its checker"
    logs = (
        ", ".join(f"{n} updates of {name}" for name, n in extremes.updates.items())
        if extremes is not None
        else ""
    )
    sources = {
        "word": "chosen when the program was compiled",
        "target": "chosen when the report was made",
        "timing": schedule,
        "timing.interval_cycles_counted": f"measured: {verified_by}",
        "timing.latency_cycles.min": f"measured: {verified_by}",
        "timing.latency_cycles.max": f"measured: {verified_by}",
        "timing.update_us": f"{schedule}; at the target's clock",
        "timing.updates_per_s": f"{schedule}; at the target's clock",
        "timing.paper_us": _PAPER,
        "timing.paper_cycles": _PAPER,
        "timing.speedup": "paper_us / update_us, the latter at the target's clock",
        "resources.available": device.resources["lut"].source,
        "resources.percent": "part of what the device has",
        "schedule": schedule,
        "numerics": "range: compiled (range_source)"
        + (f"; observed: measured on the C model, {logs}" if logs else ""),
        "accuracy": "measured: the fixed-point program, the float64 reference and the log, sample "
        "by sample",
        "verification": f"measured: {verified_by}; each level against the integer interpreter",
        "firmware": "counted in the emitted C; memory as its structures declare it",
    }
    if estimate is not None:
        made = f"estimate, {_tool(estimate)}: {estimate.command}"
        sources |= {
            "resources": made,
            "timing.fmax_mhz": f"static timing of that netlist, {NOTE}; {made}",
            "timing.update_us_at_fmax": f"latency over fmax_mhz: {NOTE}",
            "timing.critical_path": f"static timing of that netlist, {NOTE}; {made}",
        }
    if data["firmware"]["source"] is not None:
        sources["firmware.updates_per_s"] = str(data["firmware"]["source"])
    return sources


def assemble(
    core: Core,
    *,
    estimate: Estimate | None = None,
    verification: Sequence[Mapping[str, Any]] = (),
    replays: Sequence[Replay] = (),
    extremes: Extremes | None = None,
    firmware: Mapping[str, Any] | None = None,
    clock_mhz: float = 100.0,
    grade: int = 2,
    device: Device = XC6SLX9,
    command: str | None = None,
    verified_by: str = "boresight check",
) -> dict[str, Any]:
    """Build the report of a core from its parts.

    Parameters
    ----------
    core : Core
        What the report is about.
    estimate : Estimate, optional
        Area and clock.
    verification : sequence of mappings
        One per level: ``level, simulator, n_total, n_mismatch, seconds``, and where there is a
        clock either ``cycles`` {predicted, min, max} or ``cycles_predicted, cycles_min,
        cycles_max``; optionally ``interval_predicted, interval_max, error, divergence, good``.
    replays : sequence of Replay
        Runs over logs; the first one gives the figures of ``accuracy``.
    extremes : Extremes, optional
        Observed ranges of the same program.
    firmware : mapping, optional
        ``updates_per_s`` and ``source``: measured rate of the C.
    clock_mhz, grade, device
        The target.
    command : str, optional
        The command line that makes this report.
    verified_by : str
        The command that measured ``verification``.

    Returns
    -------
    dict
        Plain JSON values; the same inputs give the same dict.

    Raises
    ------
    ValueError
        If ``extremes`` belongs to another program.
    """
    program = core.program
    if extremes is not None and extremes.program.digest != program.digest:
        raise ValueError(
            f"extremes must belong to program {program.digest[:12]}, not "
            f"{extremes.program.digest[:12]}"
        )
    warnings: list[str] = []
    warn = warnings.append
    if estimate is None:
        warn("resources and clock: not known, no synthesis was run (--synth)")
    else:
        warnings += estimate.warnings
    if extremes is None:
        warn("numerics: no log was run, ranges are not observed")
    elif extremes.saturations:
        names = [program.values[n].name for n, v in enumerate(extremes.values) if v.saturations]
        warn(f"numerics: {extremes.saturations} saturations, in {', '.join(names)}")
    rows = _verification(verification, warn)
    data: dict[str, Any] = {
        "design": program.name,
        "config": core.machine.name,
        "word": program.arithmetic.word,
        "digest": program.digest,
        "command": command,
        "target": {"device": device.name, "speed": f"-{grade}", "clock_mhz": clock_mhz},
        "timing": _timing(core, estimate, rows, clock_mhz, grade, warn),
        "resources": _resources(estimate, device),
        "schedule": schedule_section(core),
        "numerics": numerics_section(program, extremes),
        "accuracy": accuracy_section(program, replays, warn),
        "verification": rows,
        "firmware": _firmware(program, firmware, warn),
        "warnings": warnings,
    }
    data["sources"] = _sources(data, estimate, extremes, device, verified_by)
    return data


def measure_c(program: Program, words: IntArray, *, seconds: float = 0.05) -> dict[str, Any]:
    """Rate of the C on this computer: the best of repeated runs over the words of a log."""
    model = CModel(program)
    best, spent = np.inf, 0.0
    while spent < seconds:
        model.reset()
        start = time.perf_counter()
        model.update(words)
        took = time.perf_counter() - start
        best, spent = min(best, took), spent + took
    return {
        "updates_per_s": float(f"{len(words) / best:.3g}"),
        "source": f"measured: best run of the C on this computer, one core, gcc "
        f"{' '.join(CFLAGS)}, {len(words)} updates",
    }


def report_data(
    core: Core,
    estimator: Estimator,
    *,
    area: Estimate | None = None,
    check: CheckResult | None = None,
    log: Record | None = None,
    comparison: bool = False,
    clock_mhz: float = 100.0,
    grade: int = 2,
    command: str | None = None,
) -> dict[str, Any]:
    """Build the report of a core: `assemble` with the parts that a check on a log gives.

    Parameters
    ----------
    area : Estimate, optional
        Area and clock.
    check, log : CheckResult, and Record, optional
        The check of this core and the log it ran on. Ranges are observed and the rate of the C is
        measured on the same samples.
    comparison : bool
        The log's reference is another device's estimate, not truth.
    clock_mhz, grade, command
        See `assemble`.

    Raises
    ------
    ValueError
        If only one of ``check`` and ``log`` is given.
    """
    if (check is None) != (log is None):
        raise ValueError("check and log must be given together")
    parts: dict[str, Any] = {}
    if check is not None and log is not None:
        program = core.program
        words = feed(estimator, log.head(len(check.outputs))).words(program)
        parts = {
            "verification": [dataclasses.asdict(level) for level in check.levels],
            "replays": [
                Replay.of_words(
                    program, log, check.outputs, reference=check.float_outputs, truth=not comparison
                )
            ],
            "extremes": observe(program, {log.name: words}),
            "firmware": measure_c(program, words),
        }
    data = assemble(core, estimate=area, clock_mhz=clock_mhz, grade=grade, command=command, **parts)
    if check is not None:
        data["accuracy"]["verdict"] = check.accuracy.to_json()
        data["warnings"] += [
            *check.warnings,
            *(f"accuracy: {line}" for line in check.accuracy.faults()),
        ]
    return data
