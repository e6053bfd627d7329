"""Cycles, clock and the longest path, as plain data."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.synthesis.estimate import Estimate
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.timing import NOTE
from boresight.sim.attitude.ma2014.paper import BESIDE, CLOCK_MHZ, TIME_US
from boresight.sim.compare.results import LevelResult

__all__ = ["PAPER", "PAPER_US", "timing_section"]

#: Published times of such a filter as software on a soft processor at 100 MHz, by estimator.
PAPER_US = {name: TIME_US[row] for name, row in BESIDE.items()}
PAPER = (
    "Ma Long et al. (2014), body text and conclusion: float software on a MicroBlaze at "
    "100 MHz in an XC6SLX9"
)
_NETS = {"median": "median", "p75": "upper-quartile"}


def timing_section(
    core: Core,
    estimate: Estimate | Mapped | Routed | None,
    levels: Sequence[LevelResult],
    clock_mhz: float,
    grade: int,
    warn: Callable[[str], None],
    rate_hz: float | None = None,
) -> dict[str, Any]:
    """Predicted and counted cycles, estimated clock, and records a second."""
    s = core.schedule
    update_us = s.latency / clock_mhz
    paper_us = PAPER_US.get(core.program.name)
    completed = [x for x in levels if not x.error]
    smallest = min((x.cycles_min for x in completed if x.cycles_min is not None), default=None)
    largest = max((x.cycles_max for x in completed if x.cycles_max is not None), default=None)
    if smallest is None:
        warn("cycles: predicted by the schedule, not counted in a simulation")
    elif (smallest, largest) != (s.latency, s.latency):
        warn(f"cycles: predicted {s.latency}, counted {smallest} to {largest}")
    if rate_hz is not None and rate_hz * s.interval > clock_mhz * 1e6:
        warn(
            f"interval: {s.interval} cycles at {clock_mhz:g} MHz are longer than a record's at "
            f"{rate_hz:g} Hz"
        )
    return {
        "latency_cycles": {"predicted": s.latency, "min": smallest, "max": largest},
        "latency_cycles_by_output": dict(zip(s.program.output_names, s.latencies, strict=True)),
        "urgent_outputs": list(s.program.output_names[: s.urgent]),
        "interval_cycles": s.interval,
        "interval_cycles_counted": max(
            (x.interval_max for x in completed if x.interval_max is not None), default=None
        ),
        "update_us": round(update_us, 4),
        "updates_per_s": round(clock_mhz * 1e6 / s.interval, 1),
        "rate_hz": None if rate_hz is None else float(f"{rate_hz:.6g}"),
        "busy_percent": None
        if rate_hz is None
        else float(f"{rate_hz * s.interval / (clock_mhz * 1e4):.3g}"),
        "paper_us": paper_us,
        "paper_cycles": round(paper_us * CLOCK_MHZ) if paper_us is not None else None,
        "speedup": round(paper_us / update_us, 1) if paper_us is not None else None,
        **_clock(estimate, s.latency, clock_mhz, grade, warn),
        "source": "cycles: the schedule, re-proven by its checker"
        + (", and counted in simulation" if smallest is not None else "")
        + (f"; clock: static timing, {NOTE}" if isinstance(estimate, Estimate) else "")
        + (f"; clock: {estimate.source}" if isinstance(estimate, Routed) else ""),
    }


def _clock(
    estimate: Estimate | Mapped | Routed | None,
    latency: int,
    clock_mhz: float,
    grade: int,
    warn: Callable[[str], None],
) -> dict[str, Any]:
    """Clocks by grade and nets, the time to the urgent outputs at each, the longest path."""
    if estimate is None or isinstance(estimate, Mapped):
        return {"fmax_mhz": None, "update_us_at_fmax": None, "critical_path": None}
    if isinstance(estimate, Routed):
        return _routed(estimate, latency)
    fmax: dict[str, dict[str, float | None]] = {}
    at_fmax: dict[str, dict[str, float | None]] = {}
    for t in sorted(estimate.timing, key=lambda t: t.grade):
        f = t.fmax_mhz
        fmax.setdefault(f"-{t.grade}", {})[t.nets] = f
        at_fmax.setdefault(f"-{t.grade}", {})[t.nets] = round(latency / f, 3) if f else None
        if t.grade == grade and f is not None and f < clock_mhz:
            warn(
                f"clock: the estimate at grade -{t.grade}, {_NETS.get(t.nets, t.nets)} nets, is "
                f"{f:g} MHz, below the {clock_mhz:g} MHz of the target"
            )
    path = _path(estimate, grade)
    return {"fmax_mhz": fmax, "update_us_at_fmax": at_fmax, "critical_path": path}


def _routed(routed: Routed, latency: int) -> dict[str, Any]:
    """The clock after routing, the time to the urgent outputs at it, the path that limits it."""
    grade, clock, steps = routed.mapped.target.grade, routed.clock_mhz, routed.worst.path
    if clock is None:
        return {"fmax_mhz": None, "update_us_at_fmax": None, "critical_path": None}
    net = math.fsum(s.ns for s in steps if s.kind == "routing")
    delay = math.fsum(s.ns for s in steps)
    return {
        "fmax_mhz": {f"-{grade}": {"routed": clock}},
        "update_us_at_fmax": {f"-{grade}": {"routed": round(latency / clock, 3)}},
        "seeds": {str(run.seed): run.clock_mhz for run in routed.runs},
        "critical_path": {
            "grade": grade,
            "nets": "routed",
            "delay_ns": round(delay, 3),
            "logic_ns": round(delay - net, 3),
            "net_ns": round(net, 3),
            "start": steps[0].start,
            "end": steps[-1].end,
            "points": [asdict(step) for step in steps],
        },
    }


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
