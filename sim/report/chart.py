"""The schedule as an SVG chart: cycles to the right, a row for the inputs and for every lane."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from boresight.sim.plotting import COLOUR

#: Fill of each kind of slot: apart in hue and, printed in grey, in lightness.
CHART_COLOURS = {
    "multiply-add": COLOUR["heading"],
    "function table": COLOUR["amber"],
    "capture": COLOUR["sky"],
    "emit": COLOUR["roll"],
    "get": COLOUR["other"],
    "idle": "#F1F1F1",
}

_WIDTH = 1120.0
_LEFT = 62.0
_RIGHT = 50.0
_ROW = 20.0
_GAP = 5.0
_LINE = 12.0  # height of a line of output names
_BAND = 128  # cycles of one band, at most


def _text(x: float, y: float, text: str, *, attributes: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}"{attributes}>{escape(text)}</text>'


def _box(x: float, y: float, width: float, kind: str, title: str) -> str:
    return (
        f'<rect x="{x:.2f}" y="{y:.1f}" width="{width:.2f}" height="{_ROW:g}" '
        f'fill="{CHART_COLOURS[kind]}"><title>{escape(title)}</title></rect>'
    )


class _Band:
    """Cycles first..last-1 of the schedule.

    From top to bottom: names of the outputs, lanes, inputs, cycle numbers. Names that would run
    into the next one stand a line above it.
    """

    def __init__(self, schedule: Mapping[str, Any], first: int, last: int, scale: float) -> None:
        self.schedule, self.first, self.last, self.scale = schedule, first, last, scale
        self.lanes = len(schedule["lanes"])
        outputs = sorted(o for o in schedule["chart"]["outputs"] if first <= o[0] < last)
        self.outputs: list[tuple[int, str, int]] = []  # cycle, text, line
        line, right = -1, math.inf
        for cycle, name, latency in reversed(outputs):
            text = f"{name}: {latency}"
            fits = self.x(cycle) + 9 + 5.8 * len(text) < right
            line = 0 if fits else line + 1
            right = self.x(cycle)
            self.outputs.append((cycle, text, line))
        lines = max((line + 1 for _, _, line in self.outputs), default=0)
        self.names = _LINE * lines + 6
        self.height = self.names + (self.lanes + 1) * (_ROW + _GAP) + 22

    def x(self, cycle: float) -> float:
        return _LEFT + (cycle - self.first) * self.scale

    def draw(self, top: float) -> Iterator[str]:
        chart, first, last = self.schedule["chart"], self.first, self.last
        lanes = [top + self.names + k * (_ROW + _GAP) for k in range(self.lanes)]
        inputs = lanes[-1] + _ROW + _GAP
        for name, y in (*((f"lane {k}", y) for k, y in enumerate(lanes)), ("inputs", inputs)):
            yield _text(_LEFT - 6, y + _ROW * 0.7, name, attributes=' text-anchor="end"')
            yield _box(
                self.x(first),
                y,
                (last - first) * self.scale,
                "idle",
                "no input word" if name == "inputs" else "idle",
            )
        op_at = {(s[1], s[0]): s[4] for s in chart["slots"]}
        for cycle, lane, kind, label, op in chart["slots"]:
            if first <= cycle < last:
                # Slots of one result stand together; a gap parts them from the next.
                gap = 0.0 if op is not None and op_at.get((lane, cycle + 1)) == op else 0.9
                yield _box(
                    self.x(cycle),
                    lanes[lane],
                    self.scale - gap,
                    kind,
                    f"cycle {cycle}, lane {lane}: {label}",
                )
        for cycle, name in chart["gets"]:
            if first <= cycle < last:
                yield _box(self.x(cycle), inputs, self.scale - 0.9, "get", f"cycle {cycle}: {name}")
        for cycle, text, line in self.outputs:
            x, y = self.x(cycle + 0.5), lanes[0] - 6 - line * _LINE
            yield f'<line x1="{x:.1f}" y1="{y - 8:.1f}" x2="{x:.1f}" y2="{lanes[0] + 3:.1f}"/>'
            yield _text(x + 3, y, text, attributes=' class="out"')
        bottom = inputs + _ROW
        step = 10 if last - first > 60 else 5
        for cycle in range(-(-first // step) * step, last + 1, step):
            x = self.x(cycle)
            yield (
                f'<line class="tick" x1="{x:.1f}" y1="{bottom:.1f}" x2="{x:.1f}" '
                f'y2="{bottom + 4:.1f}"/>'
            )
            yield _text(x, bottom + 14, str(cycle), attributes=' text-anchor="middle" class="tick"')


def schedule_chart(schedule: Mapping[str, Any]) -> str:
    """SVG element of ``schedule`` (`sim.report.schedule.schedule_section`)."""
    cycles = schedule["cycles"]
    size = -(-cycles // -(-cycles // _BAND))
    scale = (_WIDTH - _LEFT - _RIGHT) / size
    parts: list[str] = []
    top = 0.0
    for first in range(0, cycles, size):
        band = _Band(schedule, first, min(cycles, first + size), scale)
        parts += band.draw(top)
        top += band.height
    return (
        f'<svg class="chart" role="img" viewBox="0 0 {_WIDTH:g} {top:g}">\n'
        + "\n".join(parts)
        + "\n</svg>"
    )
