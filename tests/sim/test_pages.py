"""`sim.pages`: numbers and units for people; templates escape and miss nothing in silence."""

import jinja2
import pytest

from boresight.sim import pages
from boresight.sim.pages import number, page, unit


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "\N{EM DASH}"),
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
    assert unit("uT") == "\u00b5T" and unit("") == ""


def test_page(tmp_path, monkeypatch) -> None:
    (tmp_path / "page.html").write_text("<p>{{ name }} {{ value | number }}</p>\n")
    monkeypatch.setattr(pages, "files", lambda package: tmp_path / package)
    assert page("", "page.html", name="<b>", value=31600) == "<p>&lt;b&gt; 31\u202f600</p>\n"
    with pytest.raises(jinja2.UndefinedError, match="value"):
        page("", "page.html", name="x")
