"""`sim.pages`: numbers and units for people; templates escape and miss nothing in silence."""

import pytest

from boresight.sim.pages import number, unit
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
