"""`sim.report.chart`: everything is drawn, inside the drawing, and nothing twice."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from boresight.gateware.core import Core
from boresight.sim.report.chart import CHART_COLOURS, schedule_chart
from boresight.sim.report.schedule import schedule_section


@pytest.mark.parametrize("which", ["core", "small_core"])
def test_chart(which: str, request: pytest.FixtureRequest) -> None:
    core: Core = request.getfixturevalue(which)
    section = schedule_section(core)
    svg = ET.fromstring(schedule_chart(section))
    _, _, width, height = map(float, svg.attrib["viewBox"].split())
    boxes = svg.findall("rect")
    assert len({(b.attrib["x"], b.attrib["y"]) for b in boxes}) >= section["slots_total"]
    for box in boxes:
        assert (
            0
            <= float(box.attrib["x"])
            <= float(box.attrib["x"]) + float(box.attrib["width"])
            <= width
        )
        assert 0 <= float(box.attrib["y"]) <= height - float(box.attrib["height"])
    fills = [b.attrib["fill"] for b in boxes]
    for kind in ("multiply-add", "function table", "capture", "emit"):
        wanted = sum(s[2] == kind for s in section["chart"]["slots"])
        assert fills.count(CHART_COLOURS[kind]) == wanted
    assert fills.count(CHART_COLOURS["get"]) == len(core.program.inputs)
    titles = {t.text for t in svg.iter("title")}
    assert all(f"cycle {s[0]}, lane {s[1]}: {s[3]}" in titles for s in section["chart"]["slots"])


def test_names_of_outputs_do_not_run_into_each_other(small_core: Core) -> None:
    svg = ET.fromstring(schedule_chart(schedule_section(small_core)))
    names = [
        (float(t.attrib["x"]), float(t.attrib["y"]), t.text or "")
        for t in svg.findall("text")
        if t.attrib.get("class") == "out"
    ]
    assert sorted(t.split(":")[0] for _, _, t in names) == sorted(small_core.program.output_names)
    for x, y, text in names:
        assert y > 8
        for x2, y2, _ in names:
            assert y2 != y or x2 <= x or x + 5.5 * len(text) < x2
