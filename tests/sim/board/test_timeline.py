"""The figure: every frame, every part of the core's work, and the paper's time beside ours."""

from __future__ import annotations

import re
from dataclasses import replace

from boresight.sim.board.timeline import Span, Timeline, timeline_plot
from boresight.sim.plotting import COLOUR

ONE = Timeline(
    filter="one",
    frames=tuple(Span(name, 30.0 * k, 30.0 * k + 16.0) for k, name in enumerate(("temp", "gx"))),
    core=(Span("calibrate", 60.0, 60.7), Span("switch", 60.7, 60.8), Span("filter", 60.8, 64.25)),
    line=Span("frame", 64.25, 500.0),
    period_us=976.5,
    paper_us=1140.0,
)
OTHER = replace(ONE, filter="other", paper_us=None)


def test_lengths() -> None:
    assert ONE.core[2].length_us == 64.25 - 60.8
    assert ONE.in_registers_us == 64.25
    assert replace(ONE, core=ONE.core[::-1]).in_registers_us == 64.25


def test_what_is_written_beside_what() -> None:
    svg = timeline_plot([ONE, OTHER], salt="x")
    assert svg == timeline_plot([ONE, OTHER], salt="x") != timeline_plot([ONE, OTHER], salt="y")
    texts = re.findall(r">([^<>]+)</text>", svg)
    for text in ("temp", "gx", "attitude frame", "attitude in registers 64.25 µs"):
        assert texts.count(text) == 1, text
    assert "One sample through the board (one)" in texts
    # The core's part and the filter alone, for each; a part too short for its name has none.
    assert texts.count("calibrate") == texts.count("filter") == 2 and "switch" not in texts
    assert [t.strip() for t in texts].count("4.25 µs") == [t for t in texts].count("3.45 µs") == 2
    assert texts.count("1,140 µs in the paper") == 1
    assert texts.count("one") == texts.count("other") == 2


def test_a_bar_for_each_span() -> None:
    svg = timeline_plot([ONE], salt="x")
    bars = re.findall(r'style="fill: (#\w+); stroke: #ffffff', svg)
    names = ["roll"] * 2 + ["amber", "grey", "heading"] * 2 + ["sky"]
    assert sorted(bars) == sorted(COLOUR[name].lower() for name in names)
