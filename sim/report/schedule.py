"""The schedule as plain data: busy cycles of each unit, and the data of a chart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.schedule.slots import Schedule, Slot

#: Kinds of issue slots, in the order of the chart's legend.
KINDS = ("multiply-add", "function table", "capture", "emit")


def _kind(schedule: Schedule, slot: Slot) -> str:
    if slot.op is None:
        return "emit"
    if slot.term is None:
        return "capture"
    term = schedule.program.ops[slot.op].terms[slot.term]
    return "multiply-add" if term.coefficient is None else "function table"


#: Source lines that are named, at most.
_LINES = 8


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


def schedule_section(core: Core, lines: Mapping[int, str] | None = None) -> dict[str, Any]:
    """Units with their load, totals, source ``lines`` with most slots, and the chart.

    ``emitted`` are the slots that only send an output. ``units`` has a row for every lane and kind
    of slot, and for the input and output words. In ``chart``, ``slots`` are
    [cycle, lane, kind, op], ``gets`` [cycle, name] and ``outputs`` [cycle of the emit slot,
    name, latency].
    """
    s = core.schedule
    names = [v.name for v in s.program.values]
    slots = [[x.cycle, x.lane, _kind(s, x), x.op] for x in s.slots]
    lanes = range(s.machine.lanes)

    def unit(unit_: str, op: str, count: int) -> dict[str, Any]:
        return {
            "unit": unit_,
            "op": op,
            "count": count,
            "busy_cycles": count,
            "utilisation": round(count / s.length, 4),
        }

    count = Counter((lane, kind) for _, lane, kind, _ in slots)
    units = [unit(f"lane {lane}", kind, count[lane, kind]) for lane in lanes for kind in KINDS]
    units += [unit("input", "get", len(s.gets)), unit("output", "emit", len(s.latencies))]
    return {
        "units": [u for u in units if u["count"]],
        "lanes": [
            {
                "lane": k,
                "busy_cycles": sum(x.lane == k for x in s.slots),
                "results": sum(x.lane == k for x in s.ends.values()),
                "utilisation": round(s.lane_use[k], 4),
            }
            for k in lanes
        ],
        "ops_total": len(core.program.ops),
        "copies": len(s.program.ops) - len(core.program.ops),
        "slots_total": len(slots),
        "cycles": s.length,
        "lines": _by_line(core, lines or {}),
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
