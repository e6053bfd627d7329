"""`sim.plotting`: numbers and units for people; one style sheet; the same SVG for the same data."""

import pytest

from boresight.sim.plotting import COLOUR, INK, figure_and_axes, number, settings, svg, unit
from tests.support.tree import ROOT


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "\N{EM DASH}"),
        (float("nan"), "\N{EM DASH}"),
        (-float("inf"), "-inf"),
        (0, "0"),
        (0.0, "0"),
        (120, "120"),
        (31600, "31,600"),
        (263.3, "263.3"),
        (1.2, "1.2"),
        (8.18668e-6, "8.187e-06"),
        (-0.5, "-0.5"),
        (487804.9, "487,805"),
        (2e12, "2e+12"),
        (76.7, "76.7"),
    ],
)
def test_number(value: float | None, text: str) -> None:
    assert number(value) == text


def test_units() -> None:
    assert unit("ht") == "half turns" and unit("m/s^2") == "m/s^2"


def test_there_is_one_style_sheet() -> None:
    templates = [path for folder in ("sim", "systems") for path in (ROOT / folder).rglob("*.html")]
    assert [path.name for path in templates if "<style" in path.read_text()] == ["base.html"]
    assert len(templates) >= 3


def drawn(salt: str = "one", **keywords) -> str:
    with settings():
        figure, axes = figure_and_axes(2.0, **keywords)
        for axis in getattr(axes, "flat", [axes]):
            axis.plot((0.0, 1.0), (1.0, 0.0), color=COLOUR["roll"], label="a & b")
        return svg(figure, salt)


def test_an_element_for_html() -> None:
    text = drawn()
    assert text == drawn()
    assert text.startswith('<svg class="plot" role="img" viewBox="0 0 748.8 144">')
    assert text.endswith("</svg>") and text.count("<svg") == 1
    for outside in ("xmlns", "xlink", "<metadata", "<?xml", "<!DOCTYPE", "http", "Matplotlib v"):
        assert outside not in text, outside
    assert "\n " not in text
    assert INK in text and COLOUR["roll"].lower() in text
