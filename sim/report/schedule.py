"""The schedule: slots of each source line as plain data, and a chart of all as SVG."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.schedule.slots import Schedule, Slot
from boresight.sim.plotting import COLOUR, figure_and_axes, settings, svg

#: Fill of each kind of slot: apart in hue and, printed in grey, in lightness.
CHART_COLOURS = {
    "multiply-add": COLOUR["heading"],
    "function table": COLOUR["amber"],
    "capture": COLOUR["sky"],
    "emit": COLOUR["roll"],
    "get": COLOUR["other"],
    "idle": "#F1F1F1",
}
#: Cycles of one band, at most, and inches of a row and of a line of output names.
_BAND, _ROW, _LINE = 128, 0.26, 0.13
#: Source lines that are named, at most.
_LINES = 8


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


def schedule_chart(schedule: Mapping[str, Any]) -> str:
    """SVG element of ``schedule`` (`schedule_section`), in bands of cycles."""
    cycles, chart, lanes = schedule["cycles"], schedule["chart"], schedule["lanes"]
    size = -(-cycles // -(-cycles // _BAND))
    bands = [(first, min(cycles, first + size)) for first in range(0, cycles, size)]
    # (row, kind) of bars: start and width. Slots of one result stand together; a gap parts others.
    op_at = {(lane, cycle): op for cycle, lane, _, op in chart["slots"]}
    bars: dict[tuple[int, str], list[tuple[float, float]]] = {}
    for cycle, lane, kind, op in chart["slots"]:
        gap = 0.0 if op is not None and op_at.get((lane, cycle + 1)) == op else 0.12
        bars.setdefault((lane, kind), []).append((cycle, 1.0 - gap))
    bars[lanes, "get"] = [(cycle, 0.88) for cycle, _ in chart["gets"]]
    outputs = sorted(chart["outputs"])
    named = [_lines([o for o in outputs if a <= o[0] < b], a, size) for a, b in bands]
    tops = [_LINE * (1 + max((line for *_, line in names), default=0)) for names in named]
    heights = [top + _ROW * (lanes + 1) + 0.3 for top in tops]
    with settings():
        figure, plots = figure_and_axes(
            sum(heights), len(bands), squeeze=False, gridspec_kw={"height_ratios": heights}
        )
        for axes, (first, stop), names, top in zip(plots[:, 0], bands, named, tops, strict=True):
            axes.grid(False)
            axes.spines[:].set_visible(False)
            axes.set_xlim(first, first + size)
            axes.set_ylim(lanes + 0.5, -0.5 - top / _ROW)
            axes.set_yticks(range(lanes + 1), [*(f"lane {k}" for k in range(lanes)), "inputs"])
            axes.tick_params(axis="y", length=0)
            axes.set_xticks(range(-(-first // 10) * 10, stop + 1, 10))
            idle = {(row, "idle"): [(first, stop - first)] for row in range(lanes + 1)}
            for (row, kind), spans in (idle | bars).items():
                here = [x for x in spans if first <= x[0] < stop]
                axes.broken_barh(here, (row - 0.4, 0.8), color=CHART_COLOURS[kind], linewidth=0)
            for cycle, text, line in names:
                y = -0.5 - line * _LINE / _ROW
                axes.vlines(cycle + 0.5, y - 0.4, -0.3, color=CHART_COLOURS["emit"])
                axes.text(cycle + 0.9, y, text, fontsize=7.5)
        return svg(figure, "schedule")


def _lines(outputs: list[Any], first: int, size: int) -> list[tuple[int, str, int]]:
    """Cycle, text and line of each output; one that would run into the next stands above it."""
    named, line, right = list[tuple[int, str, int]](), -1, math.inf
    for cycle, name, latency in reversed(outputs):
        text = f"{name}: {latency}"
        fits = (cycle - first) / size + 0.008 + 0.0057 * len(text) < right
        line, right = 0 if fits else line + 1, (cycle - first) / size
        named.append((cycle, text, line))
    return named
