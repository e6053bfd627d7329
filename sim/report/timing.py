"""Cycles, clock and the longest path, as plain data."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.synthesis.family import Step
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.sim.compare.results import LevelResult

#: Clock of the target, MHz.
CLOCK_MHZ = 100.0


def timing_section(
    core: Core,
    area: Mapped | Routed | None,
    levels: Sequence[LevelResult],
    grade: int,
    warn: Callable[[str], None],
    rate_hz: float | None = None,
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


def _clock(
    area: Mapped | Routed | None, latency: int, grade: int, warn: Callable[[str], None]
) -> dict[str, Any]:
    """Clocks, the time to the urgent outputs at each, and the path that limits the clock."""
    clocks: dict[str, float] = {}
    steps: tuple[Step, ...] = ()
    seeds: dict[str, Any] = {}
    if isinstance(area, Routed):
        seeds = {"seeds": {str(run.seed): run.clock_mhz for run in area.runs}}
        if area.clock_mhz is not None:
            clocks, steps = {"routed": area.clock_mhz}, area.worst.path
    elif area is not None and area.clock is not None:
        clocks, steps = area.clock.by_nets, area.clock.path
    if not clocks:
        return {"fmax_mhz": None, "update_us_at_fmax": None, "critical_path": None}
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
        "critical_path": _path(steps, grade, "routed" if seeds else "p75"),
    }


def _path(steps: Sequence[Step], grade: int, nets: str) -> dict[str, Any]:
    """The path that limits the clock."""
    net = math.fsum(s.ns for s in steps if s.kind == "routing")
    delay = math.fsum(s.ns for s in steps)
    return {
        "grade": grade,
        "nets": nets,
        "delay_ns": round(delay, 3),
        "logic_ns": round(delay - net, 3),
        "net_ns": round(net, 3),
        "start": steps[0].start,
        "end": steps[-1].end,
        "points": [asdict(step) for step in steps],
    }
