"""`sim.report.plots`: valid SVG, the same each time, with units."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from boresight.sim.report.plots import euler_plot, float_difference_plot, log_difference_plot

T = [0.0, 0.1, 0.2, 0.3]
CURVES = {
    "heading": [170.0, 179.0, -179.0, -170.0],
    "pitch": [1.0, None, 3.0, 4.0],
    "roll": [0.0, 0.0, 0.0, 0.0],
}


def test_plots() -> None:
    texts = [
        (euler_plot(T, CURVES, CURVES, "truth", salt="a"), ["angle, deg", "roll, truth"]),
        (euler_plot(T, CURVES, None, "truth", salt="a"), ["angle, deg"]),
        (float_difference_plot(T, CURVES, 24, salt="b"), ["|fixed (W = 24) - float64|, deg"]),
        (
            log_difference_plot(
                T,
                {"heading": [1.0, 2.0, None, 3.0], "inclination": [None] * 4},
                "comparison",
                salt="c",
            ),
            ["difference to the comparison, deg"],
        ),
    ]
    for svg, words in texts:
        assert ET.fromstring(svg).attrib["class"] == "plot"
        assert "http" not in svg and "metadata" not in svg and "xmlns" not in svg
        shown = {t.text for t in ET.fromstring(svg).iter("text")}
        assert {"time from the first sample, s", *words} <= shown


def test_same_data_same_text() -> None:
    first = euler_plot(T, CURVES, CURVES, "truth", salt="a")
    assert euler_plot(T, CURVES, CURVES, "truth", salt="a") == first


def test_an_angle_that_wraps_leaves_a_gap() -> None:
    straight = euler_plot(T, {"heading": [10.0, 20.0, 30.0, 40.0]}, None, "", salt="a")
    wrapped = euler_plot(T, {"heading": CURVES["heading"]}, None, "", salt="a")

    def strokes(svg: str) -> int:
        line = next(
            p.attrib["d"]
            for p in ET.fromstring(svg).iter("path")
            if "#0072b2" in p.attrib.get("style", "")
        )
        return line.count("L")

    assert strokes(straight) == 3
    assert strokes(wrapped) < 3
