"""`sim.report.plots`: valid SVG, the same each time, with units."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

from boresight.sim.plotting import RED
from boresight.sim.report.plots import error_plot, log_difference_plot, output_plot, width_plot

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
    assert {TIME, "deg", "m/s", "1", "bits", "heading", "speed", "gain", "status"} <= set(shown)
    assert "attitude" not in shown and shown.count("truth") == 1
    assert "sample" in texts(output_plot(T, "sample", OUTPUTS, "truth", salt="a"))


def test_errors_with_tolerances() -> None:
    shown = texts(error_plot(T, TIME, OUTPUTS, salt="b"))
    assert {"attitude", "tolerance 0.125", "tolerance 0.25", "tolerance 0.5"} <= set(shown)
    assert {f"|fixed - float64|{u}" for u in (", deg", ", m/s", "")} <= set(shown)
    assert "status" not in shown


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
        one = {"heading": output(unit, OUTPUTS["heading"]["fixed"])}
        svg = output_plot(T, TIME, one, "", salt="a")
        line = next(
            p.attrib["d"]
            for p in ET.fromstring(svg).iter("path")
            if "#0072b2" in p.attrib.get("style", "")
        )
        return line.count("L")

    assert strokes("m") == 3
    assert strokes("deg") < 3
