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
    """Load of the lanes, totals, source ``lines`` with most slots, and the chart.

    ``emitted`` are the slots that only send an output. In ``chart``, ``slots`` are
    [cycle, lane, kind, op], ``gets`` [cycle, name] and ``outputs`` [cycle of the emit slot,
    name, latency].
    """
    s = core.schedule
    names = [v.name for v in s.program.values]
    slots = [[x.cycle, x.lane, _kind(s, x), x.op] for x in s.slots]
    count = Counter((lane, kind) for _, lane, kind, _ in slots)
    return {
        "lanes": [
            {
                "slots": {kind: count[k, kind] for kind in KINDS},
                "results": sum(x.lane == k for x in s.ends.values()),
            }
            for k in range(s.machine.lanes)
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
