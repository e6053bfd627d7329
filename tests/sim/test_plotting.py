"""`sim.plotting`: numbers and units for people; one style sheet; the same SVG for the same data."""

import pytest

from boresight.sim.plotting import COLOUR, INK, figure_and_axes, number, settings, svg, unit
from tests.support.tree import ROOT


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "\N{EM DASH}"),
        (float("nan"), "\N{EM DASH}"),
        (-float("inf"), "\u2212\u221e"),
        (0, "0"),
        (0.0, "0"),
        (120, "120"),
        (31600, "31\u202f600"),
        (263.3, "263.3"),
        (1.2, "1.2"),
        (8.18668e-6, "8.19\u00d710\u207b\u2076"),
        (-0.5, "\u22120.5"),
        (487804.9, "487\u202f805"),
        (2e12, "2\u00d710\u00b9\u00b2"),
        (76.7, "76.7"),
    ],
)
def test_number(value: float | None, text: str) -> None:
    assert number(value) == text


def test_units() -> None:
    assert unit("(m/s^2)^2") == "(m/s\u00b2)\u00b2" and unit("ht") == "half turns"
    assert unit("m^2/s^3") == "m\u00b2/s\u00b3" and unit("(m)^2") == "m\u00b2"
    assert unit("s^-1") == "s\u207b\u00b9"
    assert unit("uT") == "\u00b5T" and unit("") == ""


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
