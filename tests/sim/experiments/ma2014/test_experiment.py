"""The whole experiment, small: fields, targets, page."""

from __future__ import annotations

import json
import math
import re
from copy import deepcopy

import numpy as np
import pytest

from boresight.sim.experiments.experiment import grouped
from boresight.sim.experiments.ma2014 import experiment
from boresight.sim.experiments.ma2014.targets import entries_in_band, targets


@pytest.fixture(scope="module")
def said():
    return []


@pytest.fixture(scope="module")
def result(said):
    return experiment.Ma2014().run(seed=5, runs=3, say=said.append)


@pytest.fixture(scope="module")
def data(result):
    return result.details


@pytest.fixture(scope="module")
def page(result):
    return result.pages["ma2014.html"]


def find(found, name):
    (group,) = (g for g in grouped(found) if g[0].name.startswith(name))
    return group


def good(found, name):
    return all(target.good for target in find(found, name))


def test_all_tables_and_figures_are_there(result, data):
    assert result.good and data["seed"] == 5 and data["shown_seed"] in (5, 6, 7)
    assert [r["ours_deg"] for r in data["table_1"]] == [list(r["end_deg"]) for r in data["table_1"]]
    assert data["table_2"]["gyro_var"][2] == 2.1155e-6
    for case in data["table_3"]["cases"].values():
        assert {"gyro", "mag_acc", "complementary", "letter"} <= set(case)
        assert case["mag_acc"]["fixed"] is None and case["complementary"]["fixed"]
    assert set(data["spectra"]["methods"]) >= {"gyro", "mag_acc", "complementary"}
    assert len(data["figures"]["time_s"]) == 374 * 8 + 1 == len(data["figures"]["truth_deg"])
    assert {r["config"] for r in data["timing"]} == {"small", "fast"}
    assert data["table_4"]["kp"] == (0.1414, 0.1414, 0.1)


def test_it_is_json_without_nan(data):
    assert json.loads(json.dumps(data, allow_nan=False))["runs"] == 3


def test_progress_names_what_runs(said, data):
    text = "\n".join(said)
    for part in ("section 3.2", "section 1.3", "eq. (3)", "integer interpreter", "schedules"):
        assert part in text


def test_pooled_is_the_root_of_the_mean_variance(data):
    row = data["table_3"]["cases"]["C"]["complementary"]
    runs = np.array(row["sd_runs"])
    assert runs.shape == (3, 3)
    np.testing.assert_allclose(
        row["fixed"]["sd"]["pooled"], np.sqrt(np.square(runs).mean(axis=0)), atol=2e-5
    )
    np.testing.assert_allclose(row["fixed"]["sd"]["median"], np.median(runs, axis=0), atol=2e-5)


def test_the_run_shown_is_the_one_in_the_middle(data):
    heading = np.array(data["table_3"]["cases"]["C"]["complementary"]["sd_runs"])[:, 2]
    assert data["shown_seed"] - 5 == int(np.argsort(heading)[1])
    shown = np.array(data["figures"]["error_deg"]["complementary"])[:, 2]
    assert shown.std() == pytest.approx(heading[data["shown_seed"] - 5], abs=1e-4)


def test_numbers_that_do_not_hang_on_the_draw(result, data):
    """The parts of the specification that three runs suffice for."""
    noise = data["table_3"]["cases"]["noise"]
    np.testing.assert_allclose(
        noise["complementary"]["fixed"]["sd"]["pooled"], (0.070, 0.079, 0.12), rtol=0.1
    )
    np.testing.assert_allclose(
        noise["letter"]["float"]["sd"]["pooled"], (0.070, 0.079, 0.112), rtol=0.1
    )
    for name in (
        "magnetometer and accelerometer alone: sd, noise alone",
        "eq. (3) as printed: gyro integrated at 100 Hz",
        "eq. (3) as printed violates the heading",
        "complementary filter: fixed point against float",
        "gyro error: share",
    ):
        assert good(result.targets, name), name
    (time,) = find(result.targets, "complementary on fast")
    assert time.value < 3.0 and time.high == 316.0 and time.beside == {"paper": 316.0}
    gyro = data["table_3"]["cases"]["bias"]["gyro"]["fixed"]["sd"]["pooled"]
    np.testing.assert_allclose(gyro, (8, 38, 14), rtol=0.1)  # the bias left in


def test_figures_are_those_of_the_tables(result, data):
    sd = data["table_3"]["cases"]["C"]["complementary"]["fixed"]["sd"]["pooled"]
    assert result.figures["complementary: sd, C, heading, deg"] == sd[2]
    assert result.figures["complementary on fast: cycles"] == 166
    assert all(math.isfinite(value) for value in result.figures.values())


def test_targets_of_the_paper_are_reported_and_ours_bind(result):
    binding = [t for t in result.targets if t.binding]
    assert [t.name.partition(":")[0] for t in binding] == [
        "ekf_quaternion",
        "ekf_quaternion_vector",
        "complementary",
        "complementary_as_printed",
    ]
    assert any(not t.good for t in result.targets if not t.binding)


def test_a_target_fails_by_its_band_and_by_nothing_else(data):
    name = "complementary filter: sd, noise alone, fixed"
    for value, verdicts in (
        ((0.070, 0.079, 0.112), (True, True, True)),
        ((0.078, 0.079, 0.112), (False, True, True)),
        ((0.070, 0.070, 0.112), (True, False, True)),
        ((0.070, 0.079, 0.13), (True, True, False)),
        ((0.070, math.nan, 0.112), (True, False, True)),
    ):
        changed = deepcopy(data)
        changed["table_3"]["cases"]["noise"]["complementary"]["fixed"]["sd"]["pooled"] = value
        found = find(targets(changed), name)
        assert tuple(t.good for t in found) == verdicts
        assert [t.part for t in found] == ["pitch", "roll", "heading"]


def test_entries_in_band_are_counted_run_by_run():
    def row(key, sd_runs):
        return {"paper_row": key, "sd_runs": sd_runs}

    cases = {
        "gyro": row("gyro", [[0.624, 0.676, 0.566], [0.624, 0.676, 0.9]]),
        "complementary": row("complementary", [[0.104, 0.128, 0.242], [0.01, 0.128, 0.242]]),
    }
    assert entries_in_band(cases) == {
        "entries": 6,
        "mean": 5.0,
        "most": 6,
        "runs_with_all": 1,
        "low": 0.76,
        "high": 1.18,
    }


def test_a_c_that_differs_is_not_good(monkeypatch, data):
    """The run itself says so; what was measured is a stand-in."""
    monkeypatch.setattr(experiment, "measure", lambda seed, runs, say: data)
    for wrong, updates in ((1, 9), (0, 0)):
        counts = {"complementary": (wrong, updates)}
        monkeypatch.setattr(
            experiment, "count_mismatches", lambda method, log, c=counts: c.get(method.key, (0, 9))
        )
        broken = experiment.Ma2014().run(seed=1, runs=2, say=lambda text: None)
        failed = [t.name.partition(":")[0] for t in broken.targets if t.binding and not t.good]
        assert failed == ["complementary"] and not broken.good


def test_page_stands_alone_and_shows_everything(result, data, page):
    assert page.count('<svg class="plot"') >= 5
    assert "<script" not in page and not re.search(r'(src|href)="http', page)
    for heading in (
        "Table 1",
        "Table 2",
        "Table 3",
        "Table 4",
        "Figures 1, 2 and 5",
        "Figure 6",
        "Figure 7",
        "Figure 8",
        "Targets",
        "Sensor model",
    ):
        assert heading in page, heading
    assert page.count("<figcaption>") >= 5
    assert "boresight experiment ma2014 --seed 5" in page
    groups = [[t.good for t in group] for group in grouped(result.targets)]
    assert page.count('class="missed"') == sum(not all(group) for group in groups)
    assert page.count(">FAIL<") == sum(not x for group in groups for x in group)
    for label in (
        "amplitude, deg",
        "frequency, Hz",
        "heading error, deg",
        "deg, paper",
        "time from the start of the motion, s",
    ):
        assert label in page, label
