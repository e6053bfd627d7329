"""Plots and the schedule's chart."""

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.plotting import RED
from boresight.sim.records.record import Record
from boresight.sim.report import widths as module
from boresight.sim.report.chart import CHART_COLOURS, schedule_chart
from boresight.sim.report.plots import error_plot, log_difference_plot, output_plot, width_plot
from boresight.sim.report.schedule import KINDS, schedule_section
from boresight.sim.report.widths import width_section

# -- `sim.report.plots`: valid SVG, the same each time, with units --------------------------------

T = [0.0, 0.1, 0.2, 0.3]
TIME = "time from the first sample, s"


def output(unit: str, fixed: Any = (1.0, None, 3.0, 4.0), **more: Any) -> dict[str, Any]:
    return {
        "unit": unit,
        "fixed": fixed,
        "truth": None,
        "error": [1e-9] * 4,
        "tolerance": None,
        "beyond_from": None,
    } | more


OUTPUTS = {
    "heading": output("deg", [170.0, 179.0, -179.0, -170.0], truth=[170.0, None, -179.0, -170.0]),
    "speed": output("m/s", tolerance=0.25),
    "gain": output("", error=[0.0, None, 1e-3, 2e-3], tolerance=0.5),
    "attitude": output("deg", None, tolerance=0.125),
    "status": output("bits", [0.0, 1.0, 1.0, 0.0]),
}


def texts(svg: str) -> list[str]:
    assert ET.fromstring(svg).attrib["class"] == "plot"
    assert "http" not in svg and "metadata" not in svg and "xmlns" not in svg
    return [t.text or "" for t in ET.fromstring(svg).iter("text")]


def test_a_panel_for_each_unit() -> None:
    shown = texts(output_plot(T, TIME, OUTPUTS, "truth", salt="a"))
    assert {
        TIME,
        "deg",
        "m/s",
        "dimensionless",
        "bits",
        "heading",
        "speed",
        "gain",
        "status",
    } <= set(shown)
    assert "attitude" not in shown and shown.count("truth") == 1
    assert "sample" in texts(output_plot(T, "sample", OUTPUTS, "truth", salt="a"))


def test_errors_with_tolerances() -> None:
    shown = texts(error_plot(T, TIME, OUTPUTS, salt="b"))
    assert {"attitude", "tolerance 0.125", "tolerance 0.25", "tolerance 0.5"} <= set(shown)
    assert {f"|fixed - float64|{u}" for u in (", deg", ", m/s", "")} <= set(shown)
    assert "status" not in shown


def test_a_gap_where_nothing_differs() -> None:
    def strokes(error: Any) -> int:
        times = [0.1 * k for k in range(6)]
        svg = error_plot(times, TIME, {"a": output("m", error=error)}, salt="b")
        return svg.count("M ")

    assert strokes([1e-6, 2e-6, 0.0, 0.0, 1e-6, 2e-6]) == 1 + strokes([1e-6, 2e-6] * 3)


def test_a_red_line_where_the_first_output_parts() -> None:
    parted = {
        "a": output("m", tolerance=1.0, beyond_from=0.25),
        "b": output("m", tolerance=1.0, beyond_from=0.125),
        "c": output("m", tolerance=1.0),
    }
    for svg in (
        error_plot(T, TIME, parted, salt="e"),
        output_plot(T, TIME, parted, "truth", salt="e"),
    ):
        marks = [text for text in texts(svg) if text.startswith("parts")]
        assert marks == ["parts at 0.125"]
        assert RED in svg
    assert RED not in error_plot(T, TIME, {"c": parted["c"]}, salt="e")


def point(word: int, *largest: float | None, saturated: int = 0) -> dict[str, Any]:
    outputs = [
        {"output": name, "unit": unit, "max": x, "tolerance": 0.25}
        for name, unit, x in zip(("angle", "speed", "status"), ("ht", "m/s", "words"), largest)  # noqa: B905
    ]
    return {"word": word, "saturated_updates": saturated, "outputs": outputs}


def test_errors_over_the_width() -> None:
    points = [point(18), point(20, 0.5, None, 1.0, saturated=3), point(24, 1e-3, 1e-4, 0.0)]
    shown = texts(width_plot(points, salt="w"))
    assert {"20", "24", "angle", "speed", "tolerance 45", "tolerance 0.25", "saturates"} <= set(
        shown
    )
    assert "18" not in shown and "status" not in shown
    assert {f"|fixed - float64|, {u}" for u in ("deg", "m/s")} <= set(shown)
    speed = [{**p, "outputs": p["outputs"][1:2]} for p in points[2:]]
    assert "saturates" not in texts(width_plot(speed, salt="w"))


def test_no_two_curves_of_a_panel_look_alike() -> None:
    """One that has no colour of its own leaves those that others have."""
    svg = error_plot(T, TIME, {"heading": OUTPUTS["heading"], "attitude": output("deg")}, salt="b")
    drawn = [p.attrib["style"] for p in ET.fromstring(svg).iter("path") if "style" in p.attrib]
    colours = {s.split("stroke: ")[1][:7] for s in drawn if "stroke-width: 0.9" in s}
    assert len(colours) == 2


def test_difference_to_the_log() -> None:
    curves = {"heading": [1.0, 2.0, None, 3.0], "inclination": [None] * 4}
    shown = texts(log_difference_plot(T, TIME, curves, "comparison", salt="c"))
    assert {TIME, "difference to the comparison, deg", "heading"} <= set(shown)


def test_same_data_same_text() -> None:
    first = output_plot(T, TIME, OUTPUTS, "truth", salt="a")
    assert output_plot(T, TIME, OUTPUTS, "truth", salt="a") == first


def test_an_angle_that_wraps_leaves_a_gap() -> None:
    def strokes(unit: str) -> int:
        outputs = {"heading": output(unit, OUTPUTS["heading"]["fixed"])}
        svg = output_plot(T, TIME, outputs, "", salt="a")
        line = next(
            p.attrib["d"]
            for p in ET.fromstring(svg).iter("path")
            if "#0072b2" in p.attrib.get("style", "")
        )
        return line.count("L")

    assert strokes("m") == 3
    assert strokes("deg") < 3


# -- `sim.report.chart`: everything is drawn, inside the drawing, and nothing twice ---------------


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


# -- `sim.report.schedule`: the chart's data are the schedule's -----------------------------------


def test_units_add_up(core: Core) -> None:
    s = schedule_section(core)
    for lane in s["lanes"]:
        units = [u for u in s["units"] if u["unit"] == f"lane {lane['lane']}"]
        assert sum(u["busy_cycles"] for u in units) == lane["busy_cycles"] <= s["cycles"]
        assert {u["op"] for u in units} <= set(KINDS)
    assert sum(x["busy_cycles"] for x in s["lanes"]) == s["slots_total"]
    assert sum(x["results"] for x in s["lanes"]) == s["ops_total"] + s["copies"]
    terms = sum(len(op.terms) for op in core.schedule.program.ops)
    kinds = {
        k: sum(u["count"] for u in s["units"] if u["op"] == k and u["unit"] != "output")
        for k in KINDS
    }
    assert kinds["multiply-add"] + kinds["function table"] == terms
    # A slot may send its operand and multiply it too.
    assert kinds["emit"] <= len(core.program.outputs)
    by_unit = {u["unit"]: u for u in s["units"]}
    assert by_unit["input"]["count"] == len(core.program.inputs)
    assert all(u["utilisation"] == round(u["busy_cycles"] / s["cycles"], 4) for u in s["units"])


def test_chart_names_what_happens(small_core: Core) -> None:
    chart = schedule_section(small_core)["chart"]
    program = small_core.schedule.program
    assert len({(c, lane) for c, lane, *_ in chart["slots"]}) == len(chart["slots"])
    assert [name for _, name in chart["gets"]] == [program.values[n].name for n in program.inputs]
    assert sorted(name for _, name, _ in chart["outputs"]) == sorted(program.output_names)
    assert {name: c for _, name, c in chart["outputs"]} == dict(
        zip(program.output_names, small_core.schedule.latencies, strict=True)
    )
    sent = [label.rsplit("emit ", 1)[1] for *_, label, _ in chart["slots"] if "emit " in label]
    assert sorted(sent) == sorted(program.output_names)
    by_kind = {kind: label for _, _, kind, label, _ in chart["slots"]}
    assert set(by_kind) - {"emit"} == set(KINDS) - {"emit"}
    assert ": capture " in by_kind["capture"]
    assert "[table " in by_kind["function table"] and ": term " in by_kind["multiply-add"]


# -- errors over the width of the words -----------------------------------------------------------

TOLERANCE = 2e-5


class Low(Estimator):
    """A low pass: its rounding adds up."""

    inputs = (Input("u", -1.0, 1.0, ""),)
    params = (Param("gain", 0.5, 0.0, 1.0, ""),)
    states = (State("y", -1.0, 1.0, ""),)
    outputs = (Output("y", "", tolerance=TOLERANCE),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """First order."""
        y = x.y + p.gain * (u.u - x.y)
        return {"y": y}, {"y": y}


class Full(Estimator):
    """Wrong about its range, and not judged."""

    inputs = (Input("u", -1.0, 1.0, ""),)
    outputs = (Output("y", ""),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Twice."""
        return {}, {"y": ops.bounded(2.0 * u.u, -1.5, 1.5, "it is not")}


def checked() -> CheckResult:
    build = Build(Low(), params=[{"gain": 0.03}])
    u = 0.9 * np.sign(np.sin(0.05 * np.arange(400)))
    (check,) = Check(build, levels=("fixed",)).run(Record.of({"u": u}, name="steps"))
    return check


def test_more_bits_less_error() -> None:
    check, messages = checked(), []
    result = width_section(check, (18, 22, 26), progress=messages.append)
    assert messages == ["W = 18", "W = 22", "W = 26"] and result["dataset"] == "steps"
    errors = [p["outputs"][0]["max"] for p in result["points"]]
    for wide, narrow in zip(errors[1:], errors, strict=False):
        assert 1 / 64 < wide / narrow < 1 / 4
    assert errors[0] > 2.0 * TOLERANCE > 4.0 * errors[1]
    assert [p["good"] for p in result["points"]] == [e <= TOLERANCE for e in errors]
    assert [p["good"] for p in result["points"]] == [False, True, True]
    assert result["least_good"] == 22
    assert all(p["saturated_updates"] == 0 and not p["error"] for p in result["points"])
    # The width of the run itself is the run itself.
    (same,) = width_section(check, (32,))["points"]
    assert same["outputs"] == [d.to_json() for d in check.accuracy.differences]


def test_a_good_width_below_a_bad_one_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    good = {18: False, 20: True, 22: False, 24: True, 26: True}
    monkeypatch.setattr(module, "_point", lambda check, width: {"good": good[width]})
    assert width_section(checked(), tuple(good))["least_good"] == 24
    assert width_section(checked(), (18, 20, 22))["least_good"] is None


def test_what_saturates_is_not_good() -> None:
    build = Build(Full())
    (check,) = Check(build, levels=("fixed",)).run(Record.of({"u": np.array([0.5, 1.0, 1.0])}))
    (point,) = width_section(check, (20,))["points"]
    assert point["saturated_updates"] == 2 and not point["good"]


def test_what_does_not_compile_says_why() -> None:
    (point,) = width_section(checked(), (17,))["points"]
    assert point == {
        "word": 17,
        "good": False,
        "error": point["error"],
        "saturated_updates": None,
        "outputs": [],
    }
    assert point["error"]
