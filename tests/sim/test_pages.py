"""`sim.pages`: numbers and units for people; templates escape and miss nothing in silence."""

from dataclasses import replace

import jinja2
import pytest

from boresight.sim import pages
from boresight.sim.pages import Section, Verdict, number, page, page_of, unit
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


def test_page(tmp_path, monkeypatch) -> None:
    (tmp_path / "page.html").write_text("<p>{{ name }} {{ value | number }}</p>\n")
    monkeypatch.setattr(pages, "files", lambda package: tmp_path / package)
    assert page("", "page.html", name="<b>", value=31600) == "<p>&lt;b&gt; 31\u202f600</p>\n"
    with pytest.raises(jinja2.UndefinedError, match="value"):
        page("", "page.html", name="x")


def test_a_page_of_sections() -> None:
    table = Section(
        title="Table <1>",
        columns=("a", "b", "c", "d"),
        rows=[("x", 1234.5, "5 %", Verdict("worse", good=False))],
        right=True,
    )
    plot = Section(figures=[("", "<svg>1</svg>"), ("shown & told", "<svg>2</svg>")])
    text = page_of("A <page>", ["one", Verdict("well", good=True)], [table, plot], note="at last")
    lines = text[text.index("<body>") :].splitlines()
    assert lines[1:4] == [
        "<h1>A &lt;page&gt;</h1>",
        "<p>one</p>",
        '<p><span class="ok">well</span></p>',
    ]
    assert "<title>A &lt;page&gt;</title>" in text and "<h2>Table &lt;1&gt;</h2>" in lines
    assert (
        '<tr><td>x<td class="r">1\u202f234<td class="r">5 %<td class="r"><span class="bad">worse'
        "</span></tr>" in lines
    )
    assert lines.count("<figure><svg>1</svg></figure>") == 1 == text.count("<h2>")
    assert "<figure><svg>2</svg><figcaption>shown &amp; told</figcaption></figure>" in lines
    assert '<p class="soft small">at last</p>' in lines
    # A head stands above its cells.
    mixed = page_of("", [], [replace(table, right=False)])
    assert '<th class="r">b<th>c' in mixed and '<td class="r">5 %' not in mixed


def test_there_is_one_style_sheet() -> None:
    templates = [path for folder in ("sim", "systems") for path in (ROOT / folder).rglob("*.html")]
    assert [path.name for path in templates if "<style" in path.read_text()] == ["base.html"]
    assert len(templates) >= 3
