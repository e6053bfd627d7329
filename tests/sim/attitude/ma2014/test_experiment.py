"""The experiment of 2014: bands, targets, sections, page."""

import html
import math
import re
from copy import deepcopy

import numpy as np
import pytest

from boresight.sim.attitude.ma2014 import experiment
from boresight.sim.attitude.ma2014.bands import below, each
from boresight.sim.attitude.ma2014.errors import entries_in_band, figure_6, table_3
from boresight.sim.attitude.ma2014.paper import OPEN
from boresight.sim.attitude.ma2014.sections import JUDGED, KALMAN, differences
from boresight.sim.attitude.ma2014.targets import targets

# -- the experiment's result: figures, what binds, what is said meanwhile -------------------------


def test_figures_are_those_of_the_tables(result, data):
    sd = data["table_3"]["cases"]["C"]["ma2014_cf"]["fixed"]["sd"]["pooled"]
    assert result.figures["ma2014_cf: sd, C, heading, deg"] == sd[2]
    (row,) = (
        r for r in data["timing"] if (r["estimator"], r["config"]) == ("complementary", "fast")
    )
    assert result.figures["complementary on fast: cycles"] == row["cycles"] <= 175
    assert all(math.isfinite(value) for value in result.figures.values())


def test_targets_of_the_paper_are_reported_and_ours_bind(result):
    assert result.good
    binding = [t for t in result.targets if t.binding]
    assert [t.name.partition(":")[0] for t in binding] == [
        *(["complementary filter less Kalman filter, steady gains of Table 4"] * 6),
        "ekf_quaternion",
        "ma2014_cf",
        "complementary",
        "ma2014_cf_as_printed",
    ]
    assert any(not t.good for t in result.targets if not t.binding)


def test_a_c_that_differs_is_not_good(monkeypatch, data):
    """The run itself says so; what was measured is a stand-in."""
    monkeypatch.setattr(experiment, "measure", lambda *more: data)
    for wrong, updates in ((1, 9), (0, 0)):
        counts = {"complementary": (wrong, updates)}
        monkeypatch.setattr(
            experiment, "count_mismatches", lambda method, log, c=counts: c.get(method.key, (0, 9))
        )
        broken = experiment.Ma2014().run(seed=1, runs=2, say=lambda text: None)
        failed = [t.name.partition(":")[0] for t in broken.targets if t.binding and not t.good]
        assert failed == ["complementary"] and not broken.good


# -- bands, and the axes that a target is made for ------------------------------------------------


def test_each_axis_has_its_own_entry():
    spread = {"p05": (1, 2, 3), "p95": (4, 5, 6), "median": (0, 0, 0)}
    results = list(each("a", "s", (7, 8, 9), below((7, 7, 9)), spread=spread, paper=(1, 1, 2)))
    assert [(t.part, t.value, t.high, t.good) for t in results] == [
        ("pitch", 7, 7, True),
        ("roll", 8, 7, False),
        ("heading", 9, 9, True),
    ]
    assert [t.spread for t in results] == [(1, 4), (2, 5), (3, 6)]
    assert [t.beside for t in results] == [{"paper": 1}, {"paper": 1}, {"paper": 2}]


# -- targets of errors: each axis by its own band; entries of Table 3 run by run ------------------


def test_a_target_fails_by_its_band_and_by_nothing_else(data, find):
    name = "the paper's complementary filter: sd, noise alone, fixed"
    for value, verdicts in (
        ((0.070, 0.079, 0.112), (True, True, True)),
        ((0.078, 0.079, 0.112), (False, True, True)),
        ((0.070, 0.070, 0.112), (True, False, True)),
        ((0.070, 0.079, 0.13), (True, True, False)),
        ((0.070, math.nan, 0.112), (True, False, True)),
    ):
        changed = deepcopy(data)
        changed["table_3"]["cases"]["noise"]["ma2014_cf"]["fixed"]["sd"]["pooled"] = value
        outcome = find(table_3(changed["table_3"]["cases"]), name)
        assert tuple(t.good for t in outcome) == verdicts
        assert [t.part for t in outcome] == ["pitch", "roll", "heading"]


def test_entries_in_band_are_counted_run_by_run():
    def row(key, sd_runs):
        return {"paper_row": key, "sd_runs": sd_runs}

    cases = {
        "gyro": row("gyro", [[0.624, 0.676, 0.566], [0.624, 0.676, 0.9]]),
        "ma2014_cf": row("complementary", [[0.104, 0.128, 0.242], [0.01, 0.128, 0.242]]),
    }
    assert entries_in_band(cases) == {
        "entries": 6,
        "mean": 5.0,
        "most": 6,
        "runs_with_all": 1,
        "low": 0.76,
        "high": 1.18,
    }


def test_figure_6_has_a_limit_for_each_axis(data, find):
    cases = deepcopy(data["table_3"]["cases"])
    cases["C"]["ma2014_cf"]["fixed"]["max"]["median"] = (0.5, 0.51, 0.8)
    outcome = find(figure_6(cases), "complementary filter against truth, largest, case C")
    assert [(t.high, t.good) for t in outcome] == [(0.5, True), (0.5, False), (0.8, True)]
    (printed,) = find(figure_6(cases), "eq. (3) as printed violates")
    assert (printed.part, printed.low, printed.high) == ("heading", 0.8, None)


# -- the targets of the specification: bands, and what three runs suffice for ---------------------


def test_what_holds_whatever_the_draw(result, find):
    for name in (
        "magnetometer and accelerometer alone: sd, noise alone",
        "eq. (3) as printed: gyro integrated at 100 Hz",
        "eq. (3) as printed violates the heading",
        "the paper's complementary filter: fixed point against float",
        "gyro error: share",
    ):
        assert all(target.good for target in find(result.targets, name)), name
    (time,) = find(result.targets, "complementary on fast")
    assert time.value < 3.0 and time.high == 316.0 and time.beside == {"paper": 316.0}


def test_lines_and_ratios_are_those_of_the_spectra(data, find):
    methods = deepcopy(data["spectra"]["methods"])
    methods["mag_acc"]["line_deg"] |= {"median": 0.70, "p05": 0.6, "p95": 0.8}
    methods["ma2014_cf"]["line_deg"]["median"] = 0.35
    changed = targets(data | {"spectra": data["spectra"] | {"methods": methods}})
    (line,) = find(changed, "mag/acc error: line")
    assert (line.value, line.low, line.high) == (0.70, pytest.approx(0.621), pytest.approx(0.759))
    assert line.good and line.spread == (0.6, 0.8) and line.beside == {"prototype": 0.69}
    (ratio,) = find(changed, "line at 1/6 Hz: complementary filter over mag/acc")
    assert ratio.value == pytest.approx(0.5) and ratio.good
    (own,) = find(changed, "complementary filter's error: line")
    assert not own.good


# -- what the sections measure: tables, statistics, spectra ---------------------------------------


def test_all_tables_and_figures_are_there(data):
    for case in data["table_3"]["cases"].values():
        assert {"gyro", "mag_acc", "complementary", "ma2014_cf"} <= set(case)
        assert all(row["fixed"] for row in case.values())
    assert set(data["spectra"]["methods"]) >= {"gyro", "mag_acc", "ma2014_cf"}
    assert {r["config"] for r in data["timing"]} == {"small", "fast"}
    assert data["parameters"]["complementary"]["kp_heading_per_s"] == 0.8


def test_pooled_is_the_root_of_the_mean_variance(data):
    row = data["table_3"]["cases"]["C"]["complementary"]
    runs = np.array(row["sd_runs"])
    assert runs.shape == (3, 3)
    np.testing.assert_allclose(
        row["fixed"]["sd"]["pooled"], np.sqrt(np.square(runs).mean(axis=0)), atol=2e-5
    )
    np.testing.assert_allclose(row["fixed"]["sd"]["median"], np.median(runs, axis=0), atol=2e-5)


def test_numbers_that_do_not_hang_on_the_draw(data):
    """The parts of the specification that three runs suffice for."""
    noise = data["table_3"]["cases"]["noise"]
    np.testing.assert_allclose(
        noise["ma2014_cf"]["fixed"]["sd"]["pooled"], (0.070, 0.079, 0.112), rtol=0.1
    )
    gyro = data["table_3"]["cases"]["bias"]["gyro"]["fixed"]["sd"]["pooled"]
    np.testing.assert_allclose(gyro, (8, 38, 14), rtol=0.1)  # the bias left in


def test_differences_are_those_of_the_errors():
    rng = np.random.default_rng(1)
    keys = [f"{case}/{key}" for case in JUDGED for key in ("ma2014_cf", *KALMAN)]
    errors = {key: rng.standard_normal((50, 4, 3)) for key in keys}
    deviations = differences(errors)
    assert set(deviations) == {f"{case}/{key}" for case in JUDGED for key in KALMAN}
    d = errors["C/ma2014_cf"] - errors["C/ekf_quaternion"]
    row = deviations["C/ekf_quaternion"]
    np.testing.assert_allclose(row["sd"]["pooled"], np.sqrt(d.var(axis=0).mean(axis=0)), atol=1e-5)
    largest = np.median(np.abs(d).max(axis=0), axis=0)
    np.testing.assert_allclose(row["max"]["median"], largest, atol=1e-5)


def test_the_page_has_the_targets_and_the_tables(result):
    page = html.unescape(result.pages["ma2014.html"])
    assert not re.search(r'<script|(src|href)="http', page)
    assert all(question in page and answer in page for question, answer in OPEN)
    for text in ("Table 3", "Figure 8", "Targets met", "complementary filter", "--seed 5"):
        assert text in page, text
