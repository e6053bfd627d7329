"""The schedule as an SVG chart: cycles to the right, a row for the inputs and for every lane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

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


def schedule_chart(schedule: Mapping[str, Any]) -> str:
    """SVG element of ``schedule`` (`sim.report.schedule.schedule_section`), in bands of cycles."""
    cycles, chart, lanes = schedule["cycles"], schedule["chart"], len(schedule["lanes"])
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
