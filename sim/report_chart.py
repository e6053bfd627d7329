"""The schedule as an SVG chart: cycles to the right, a row for the inputs and for every lane."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

__all__ = ["CHART_COLOURS", "schedule_chart"]

#: Fill of each kind of slot: apart in hue and, printed in grey, in lightness.
CHART_COLOURS = {
    "multiply-add": "#0072B2",
    "function table": "#E69F00",
    "capture": "#9FD3F2",
    "emit": "#007A5A",
    "get": "#CC79A7",
    "idle": "#F1F1F1",
}

_WIDTH = 1120.0
_LEFT = 62.0
_ROW = 20.0
_GAP = 5.0
_NAMES = 58.0  # height above the lanes where the names of the outputs stand
_BAND = 128  # cycles of one band, at most


def _text(x: float, y: float, text: str, *, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}"{more}>{escape(text)}</text>'


def _box(x: float, y: float, width: float, kind: str, title: str) -> str:
    return (f'<rect x="{x:.2f}" y="{y:.1f}" width="{width:.2f}" height="{_ROW:g}" '
            f'fill="{CHART_COLOURS[kind]}"><title>{escape(title)}</title></rect>')


def _band(schedule: Mapping[str, Any], first: int, last: int, top: float,
          scale: float) -> Iterator[str]:
    """Cycles first..last-1 from ``top`` down."""
    chart = schedule["chart"]
    lanes = len(schedule["lanes"])

    def x(cycle: float) -> float:
        return _LEFT + (cycle - first) * scale
    rows = {"in": top + _NAMES, **{lane: top + _NAMES + (lane + 1) * (_ROW + _GAP)
                                   for lane in range(lanes)}}
    bottom = top + _NAMES + (lanes + 1) * (_ROW + _GAP)
    for row, y in rows.items():
        name = "inputs" if row == "in" else f"lane {row}"
        yield _text(_LEFT - 6, y + _ROW * 0.7, name, more=' text-anchor="end"')
        yield _box(x(first), y, (last - first) * scale, "idle",
                   "no input taken" if row == "in" else "idle")
    for cycle, name in chart["gets"]:
        if first <= cycle < last:
            yield _box(x(cycle) + 0.4, rows["in"], scale - 0.8, "get", f"cycle {cycle}: {name}")
    shown = [s for s in chart["slots"] if first <= s[0] < last]
    after = {(s[1], s[0]): s[4] for s in chart["slots"]}
    for cycle, lane, kind, label, op in shown:
        # Slots of one result stand together; a gap parts them from the next.
        gap = 0.0 if op is not None and after.get((lane, cycle + 1)) == op else 0.9
        yield _box(x(cycle), rows[lane], scale - gap, kind, f"cycle {cycle}, lane {lane}: {label}")
    for cycle, name, latency in chart["outputs"]:
        if first <= cycle < last:
            middle = x(cycle + 0.5)
            yield (f'<line x1="{middle:.1f}" y1="{top + _NAMES - 5:.1f}" x2="{middle:.1f}" '
                   f'y2="{rows[0] + 2:.1f}"/>')
            at = f"{middle + 3:.1f} {top + _NAMES - 7:.1f}"
            yield _text(middle + 3, top + _NAMES - 7, f"{name} {latency}",
                        more=f' class="out" transform="rotate(-55 {at})"')
    step = 10 if last - first > 60 else 5
    for cycle in range(-(-first // step) * step, last + 1, step):
        yield _text(x(cycle), bottom + 9, str(cycle), more=' text-anchor="middle" class="tick"')
        yield (f'<line class="tick" x1="{x(cycle):.1f}" y1="{bottom - _GAP:.1f}" '
               f'x2="{x(cycle):.1f}" y2="{bottom:.1f}"/>')


def schedule_chart(schedule: Mapping[str, Any]) -> str:
    """SVG element of ``schedule`` (`sim.report_schedule.schedule_section`)."""
    cycles = schedule["cycles"]
    bands = -(-cycles // _BAND)
    size = -(-cycles // bands)
    scale = (_WIDTH - _LEFT - 40) / size
    height = _NAMES + (len(schedule["lanes"]) + 1) * (_ROW + _GAP) + 16
    parts = []
    for k in range(bands):
        parts += _band(schedule, k * size, min(cycles, (k + 1) * size), k * height, scale)
    return (f'<svg class="chart" role="img" viewBox="0 0 {_WIDTH:g} {bands * height:g}">\n'
            + "\n".join(parts) + "\n</svg>")
