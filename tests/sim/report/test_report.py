"""The report page of `boresight check -o`: its figures against their source."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from boresight import Estimator, Input, Output, State, ops
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult, ClaimResult
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.report import accuracy
from boresight.sim.report.data import report_data
from boresight.sim.report.page import render_html

N = 2400


class Tracker(Estimator):
    """A smoother of an angle, and a sum that saturates when it is driven too far."""

    inputs = (Input("a", -1.0, 1.0, "ht"), Input("rate", -8.0, 8.0, "m/s"))
    states = (State("m", -1.0, 1.0, "ht"), State("sum", -64.0, 64.0, "m"))
    outputs = (Output("angle", "ht", tolerance=1e-6), Output("way", "m", tolerance=1e-4))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        m = ops.wrap_ht(x.m + 0.25 * ops.wrap_ht(u.a - x.m))
        way = x.sum + 0.01 * u.rate
        return {"m": m, "sum": way}, {"angle": m, "way": way}


def record(rate: float = 1.0) -> Record:
    t = np.arange(N) / 100.0
    a = 0.2 * np.sin(t)
    return Record.of({"t": t, "a": a, "rate": np.full(N, rate), "way_true": rate * t}, name="log")


@pytest.fixture(scope="module")
def build() -> Build:
    return Build(Tracker())


@pytest.fixture(scope="module")
def checked(build: Build) -> CheckResult:
    return Check(build, levels=("c", "rtl"), simulator="verilator").run(record())[0]


@pytest.fixture(scope="module")
def saturated(build: Build) -> CheckResult:
    return Check(build, levels=("c",)).run(record(8.0))[0]


@pytest.fixture(scope="module")
def report(build: Build, checked: CheckResult) -> dict[str, Any]:
    return report_data(build.core, checked)


class Page(HTMLParser):
    """Numbers by their place, and addresses outside."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.values: dict[str, str] = {}
        self.outside: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        if path := given.get("data-path"):
            self.values[path] = given["value"] or ""
        self.outside += [v for k in ("src", "href") if (v := given.get(k)) and "#" not in v]


def test_figures_are_those_of_core_and_check(build, checked, report) -> None:
    schedule = build.core.schedule
    latency = report["timing"]["latency_cycles"]
    assert latency == dict.fromkeys(("predicted", "min", "max"), schedule.latency)
    assert report["timing"]["interval_cycles"] == schedule.interval
    assert report["timing"]["rate_hz"] == pytest.approx(100.0)
    assert {row["level"]: row["n_mismatch"] for row in report["verification"]} == {"c": 0, "rtl": 0}
    by_output = {d.output: d for d in checked.accuracy.differences}
    for row in report["accuracy"]["logs"][0]["verdict"]["outputs"]:
        assert row["max"] == by_output[row["output"]].largest
    (truth,) = report["accuracy"]["logs"][0]["truth"]
    way = checked.fixed.outputs["way"] - record().values("way_true", "")
    assert truth["max"] == pytest.approx(np.abs(way).max())
    states = {row["signal"]: row for row in report["numerics"] if row["kind"] == "state"}
    assert states["sum"]["observed_max"] == pytest.approx(0.01 * (N - 1), rel=1e-3)
    assert states["sum"]["headroom_bits"] == pytest.approx(np.log2(128.0 / 24.0), abs=0.01)
    assert report["verdict"] == {"good": True, "failures": []}
    json.dumps(report, allow_nan=False)


def test_the_page_has_the_figures_and_needs_nothing_else(report) -> None:
    text = render_html(report)
    page = Page(text)
    assert page.values["timing.interval_cycles"] == str(report["timing"]["interval_cycles"])
    latency = str(report["timing"]["latency_cycles"]["max"])
    assert page.values["timing.latency_cycles.max"] == latency
    assert not page.outside and "<script" not in text and "@import" not in text
    assert text.count("<svg") == 2 and "test_report.py, line" in text
    assert "no synthesis was run" in text and "the exact truth" in text
    assert render_html(report) == text


def test_stated_ranges_are_on_the_page_and_another_device_is_a_comparison(build, checked) -> None:
    """A bundled log's attitude is a device's estimate, which no row of the log says."""
    stated = "range of the state sum", "here.py, line 3", -64.0, 64.0, "sum", "left"
    claim = ClaimResult(*stated, None, (-70.0, 0.0), 1.1, None, sources=("inputs",))
    report = report_data(build.core, replace(checked, claims=(claim,), comparison=True))
    (line,) = report["accuracy"]["logs"][0]["stated_ranges"]
    assert line.startswith("inputs within their ranges can take sum out of its range (here.py, li")
    page = render_html(report)
    assert line[1:] in page and "a comparison, not truth" in page


def test_curves_lose_no_peak(checked, report) -> None:
    """A point stands for several samples: its error is the largest of them."""
    series = report["accuracy"]["logs"][0]["series"]
    size = series["samples_per_point"]
    assert size == -(-N // accuracy.BINS)
    error = np.abs(checked.fixed.outputs["way"] - checked.floating.outputs["way"])
    wanted = [error[k : k + size].max() for k in range(0, N, size)]
    assert series["outputs"]["way"]["error"] == pytest.approx(wanted, rel=1e-4)
    angle = series["outputs"]["angle"]
    assert angle["unit"] == "deg" and max(angle["high"]) == pytest.approx(36.0, abs=1.0)


def test_a_failure_is_on_the_page_with_its_line(build, saturated) -> None:
    report = report_data(build.core, saturated)
    assert not report["verdict"]["good"]
    text = re.sub(r"<[^>]*>", "", render_html(report))
    assert "Verdict: FAILED" in text and "SATURATED" in text and "First wrong: step" in text
    assert "test_report.py, line" in text


def test_several_logs_show_the_worst(build, checked, saturated) -> None:
    report = report_data(build.core, checked, saturated)
    worst = max(saturated.accuracy.differences, key=lambda d: d.largest / d.tolerance)
    assert report["accuracy"]["worst"]["max"] == worst.largest
    assert len(report["accuracy"]["logs"]) == 2 and not report["verdict"]["good"]
    render_html(report)
