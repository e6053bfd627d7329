"""`sim.report.html`: one file, well formed, nothing from outside, the numbers of the JSON."""

import copy
import json
import re
from html.parser import HTMLParser
from typing import Any

import pytest

from boresight.gateware.core import Core
from boresight.sim.report import html as module
from boresight.sim.report.against import against_section
from boresight.sim.report.data import report_data
from boresight.sim.report.html import net_name, render_html

VOID = {"meta", "br", "img", "link", "hr", "input"}


class Page(HTMLParser):
    """Checks nesting; gathers tags, text and the numbers that carry a path."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.numbers: dict[str, str | None] = {}
        self.text = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.tags.append((tag, values))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "data":
            path = values["data-path"]
            assert path is not None
            self.numbers[path] = values["value"]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "title"):
            self.text += data


draw_plots = module._plots


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without plots, which take a second, but for the page of the report."""
    none = dict.fromkeys(("outputs", "errors", "vs_log"), "")
    monkeypatch.setattr(module, "_plots", lambda log, number: none)


@pytest.fixture(scope="module")
def html(report: dict[str, Any]) -> str:
    return render_html(report)


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    """The page of the report, read."""
    return Page(html)


def at(data: Any, path: str) -> Any:
    """A path names keys that may hold dots themselves only in its last part."""
    keys = path.split(".")
    for key in keys:
        data = data[key]
    return data


def test_well_formed_and_small(html: str, page: Page) -> None:
    assert html.startswith("<!DOCTYPE html>") and len(html) < 3_000_000
    assert sum(tag == "svg" for tag, _ in page.tags) == 4  # schedule and three plots
    ids = [a["id"] for tag, a in page.tags if tag == "section"]
    assert ids == [
        "verification",
        "schedule",
        "resources",
        "path",
        "accuracy",
        "numerics",
        "firmware",
    ]


def test_nothing_from_outside(html: str, page: Page) -> None:
    assert re.search(r"https?://|\bsrc\s*=|@import|url\((?!#)", html) is None
    for tag, attributes in page.tags:
        assert tag not in ("script", "link", "iframe", "object", "img")
        assert (attributes.get("href") or "#").startswith("#")


def test_headline_numbers_are_those_of_the_json(page: Page, report: dict[str, Any]) -> None:
    shown = page.numbers
    assert {
        "timing.latency_cycles.predicted",
        "timing.latency_cycles.max",
        "timing.update_us",
        "timing.fmax_mhz.-2.p75",
        "resources.lut",
        "resources.dsp",
        "resources.blkmem",
        "resources.percent.lut",
        "accuracy.vs_float_max_deg",
    } <= set(shown)
    for path, value in shown.items():
        assert value is not None and float(value) == at(report, path), path


def test_every_level_has_its_line(page: Page, report: dict[str, Any]) -> None:
    text = " ".join(page.text.split())
    for level in report["verification"]:
        mismatches = f"[{level['n_mismatch']}/{level['n_total']}] mismatches"
        assert (
            f"reference, {level['n_total']} updates" if level["reference"] else mismatches
        ) in text
    assert "equal" in text and "failed" not in text


def test_names_and_guesses_are_shown_and_escaped(html: str, page: Page) -> None:
    text = page.text
    assert "lane0.<i>" in text and "lane0.&lt;i&gt;" in html
    assert "boresight report complementary <log>" in text
    assert "estimate, not ISE" in " ".join(text.split())


def test_missing_synthesis_gives_a_warning_and_no_number(core: Core) -> None:
    page = Page(render_html(report_data(core)))
    for path, value in page.numbers.items():
        if path.startswith(("resources.", "timing.fmax", "accuracy.")):
            assert value == ""
    assert not any(path.startswith("timing.fmax") for path in page.numbers)
    assert "resources and clock: not known, no synthesis was run" in page.text
    assert "MHz at" not in page.text and "No log was run." in page.text
    assert "path" not in [a.get("id") for _, a in page.tags]


def test_truth_and_comparison_have_their_names(
    html: str, report: dict[str, Any], monkeypatch: Any
) -> None:
    monkeypatch.setattr(module, "_plots", draw_plots)
    assert "exact truth" in html and "a comparison, not truth" not in html
    data = copy.deepcopy(report)
    data["accuracy"]["logs"][0]["reference"] = "comparison"
    other = render_html(data)
    assert "a comparison, not truth" in other and "exact truth" not in other
    assert ">truth<" in html and ">comparison<" in other
    assert "difference to the comparison, deg" in other


def test_failures_and_tight_formats_are_marked(core: Core, report: dict[str, Any]) -> None:
    data = copy.deepcopy(report)
    data["verification"][0] |= {"good": False, "n_mismatch": 2, "divergence": "first <here>"}
    never = {"n_total": None, "n_mismatch": None, "cycles": None, "failure": "no <tool>"}
    data["verification"][1] |= {"good": False, **never}
    data["numerics"][0] |= {"state": "saturated", "saturations": 5}
    page = Page(render_html(data))
    text = " ".join(page.text.split())
    assert "failed first <here>" in text and "failed no <tool>" in text and "None" not in text
    rows = [a.get("class") for tag, a in page.tags if tag == "tr"]
    assert "saturated" in rows


def parted(report: dict[str, Any]) -> dict[str, Any]:
    data = copy.deepcopy(report)
    wrong = {"sample": 12, "t": 0.12, "outputs": ["qw"], "culprit": "step 12 (a&b.py, line 3): <x>"}
    data["accuracy"]["logs"][0]["parted"] = wrong
    return data


def test_where_fixed_and_float_part(report: dict[str, Any], html: str) -> None:
    page = Page(render_html(parted(report)))
    text = " ".join(page.text.split())
    assert "float64 part in sample 12, 0.12 s (red line): qw beyond the tolerance" in text
    assert "First wrong: step 12 (a&b.py, line 3): <x>" in text
    assert "red line" not in html


def test_lines_are_links_where_the_file_is_known(report: dict[str, Any], html: str) -> None:
    assert "complementary.py, line " in html and "<a " not in html
    assert "<a " not in render_html(report, links={"mentary.py": "no"})
    links = {"complementary.py": 'x"y/complementary.py', "a&b.py": "a&b.py"}
    page = Page(render_html(parted(report), links=links))
    results = [a["href"] for tag, a in page.tags if tag == "a"]
    assert {(href or "").partition("#")[0] for href in results} == {
        'x"y/complementary.py',
        "a&b.py",
    }
    row = next(r for r in report["numerics"] if r["signal"] == "gx")
    assert f'x"y/complementary.py#L{row["line"].rpartition(" ")[2]}' in results


def test_bits_to_gain(report: dict[str, Any]) -> None:
    text = " ".join(Page(render_html(report)).text.split())
    rows = [r for r in report["numerics"] if r["advice"]]
    row = max(rows, key=lambda r: r["wasted_bits"])
    assert f"{row['signal']}{row['line']}{row['format']}" in text
    assert f"{row['wasted_bits']}{row['advice']}" in text
    data = copy.deepcopy(report)
    for row in data["numerics"]:
        row["advice"] = None
    assert "Bits to gain" in text and "Bits to gain" not in render_html(data)


def test_widths_another_run_and_several_logs(report: dict[str, Any]) -> None:
    data = copy.deepcopy(report)
    outputs = report["accuracy"]["verdict"]["outputs"]
    ran = {"good": True, "error": "", "saturated_updates": 0, "outputs": outputs}
    points = [
        {"word": 18, "good": False, "error": "no <fit>", "saturated_updates": None, "outputs": []},
        {"word": 20, **ran, "saturated_updates": 4, "good": False},
        {"word": 24, **ran},
    ]
    data["widths"] = {"dataset": "log", "points": points, "least_good": 24}
    data["against"] = against_section(dict(report, word=31), report)
    data["accuracy"]["logs"] *= 2
    for o in data["accuracy"]["verdict"]["outputs"]:
        o["log"] = "second"
    page = Page(render_html(data))
    text = " ".join(page.text.split())
    ids = [a["id"] for tag, a in page.tags if tag == "section"]
    assert ids[0] == "against" and ids[-3:] == ["widths", "numerics", "firmware"]
    assert "24 bits and more keep every tolerance" in text
    assert "W = 18: no <fit>" in text and "W = 20: 4 updates saturate" in text
    assert "word31321.03bits" in text and "second" in text
    assert sum(tag == "svg" for tag, _ in page.tags) == 2  # schedule, widths
    data["widths"] = data["widths"] | {"points": points[:1], "least_good": None}
    data["against"] = against_section(report, report)
    text = " ".join(Page(render_html(data)).text.split())
    assert "none of them keeps every tolerance" in text and "Nothing differs." in text


def test_the_verdict_comes_first(page: Page, report: dict[str, Any]) -> None:
    good = " ".join(page.text.split())
    assert report["verdict"] == {"good": True, "failures": []}
    assert good.index("Verdict: good") < good.index("bit words") and "FAILED" not in good
    data = copy.deepcopy(report)
    data["verdict"] = {"good": False, "failures": ["pos max 3 m: BEYOND 1", "rtl in x: no run"]}
    data["warnings"] += ["accuracy: pos max 3 m: BEYOND 1", "verification: rtl failed: no run"]
    text = " ".join(Page(render_html(data)).text.split())
    assert text.index("Verdict: FAILED") < text.index("BEYOND 1") < text.index("bit words")
    assert text.count("BEYOND 1") == text.count("no run") == 1
    assert report["warnings"][0] in text


def test_every_slot_is_in_the_table_of_lines(page: Page, report: dict[str, Any]) -> None:
    text = " ".join(page.text.split())
    schedule = report["schedule"]
    assert f"outputs that are sent{schedule['emitted']}" in text and schedule["emitted"]
    named = sum(row["slots"] for row in schedule["lines"])
    assert f"other lines{schedule['slots_total'] - named - schedule['emitted']}" in text


def test_a_long_chart_is_folded(page: Page, report: dict[str, Any]) -> None:
    folds = sum(tag == "details" for tag, _ in page.tags)
    data = copy.deepcopy(report)
    data["schedule"]["cycles"] = 3133
    long = Page(render_html(data))
    assert sum(tag == "details" for tag, _ in long.tags) == folds + 1
    assert "The chart: 3\N{NARROW NO-BREAK SPACE}133 cycles" in long.text


def test_half_turns_are_in_degrees_in_tables_as_in_plots(report: dict[str, Any]) -> None:
    data = copy.deepcopy(report)
    for o in data["accuracy"]["verdict"]["outputs"]:
        o |= {"unit": "ht", "max": 0.01, "rms": 0.005, "tolerance": 0.02}
    text = " ".join(Page(render_html(data)).text.split())
    assert "1.80.93.6deg" in text and "half turns0" not in text


def test_same_data_same_text(html: str, report: dict[str, Any], monkeypatch: Any) -> None:
    monkeypatch.setattr(module, "_plots", draw_plots)
    assert render_html(json.loads(json.dumps(report))) == html


def test_one_lane(small_core: Core) -> None:
    page = Page(render_html(report_data(small_core)))
    assert "lane 0" in page.text and "lane 1" not in page.text


def test_not_finite_is_refused(report: dict[str, Any]) -> None:
    data = dict(report, timing=dict(report["timing"], update_us=float("nan")))
    with pytest.raises(ValueError, match=r"^timing\.update_us must be finite, not nan$"):
        render_html(data)


def test_nets() -> None:
    assert net_name("$abc$1") == "(made by synthesis)" and net_name("lane0.p") == "lane0.p"
