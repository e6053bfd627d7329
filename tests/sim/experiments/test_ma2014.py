"""The whole experiment, small: fields, targets, page."""

from __future__ import annotations

import json
import math
import re
from copy import deepcopy

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments import ma2014
from boresight.sim.experiments.ma2014_html import render
from boresight.sim.experiments.ma2014_targets import entries_in_band, targets


@pytest.fixture(scope="module")
def said():
    return []


@pytest.fixture(scope="module")
def data(said):
    return ma2014.run(seed=5, runs=3, progress=said.append)


@pytest.fixture(scope="module")
def page(data):
    return render(data)


def find(data, name, source=""):
    found = [t for t in data["targets"] if t["name"].startswith(name) and source in t["source"]]
    assert len(found) == 1, [t["name"] for t in found]
    return found[0]


def test_all_tables_and_figures_are_there(data):
    assert data["good"] and data["seed"] == 5 and data["shown_seed"] in (5, 6, 7)
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
    assert json.loads(json.dumps(data, allow_nan=False))["experiment"] == "ma2014"


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


def test_numbers_that_do_not_hang_on_the_draw(data):
    """The parts of the specification that three runs suffice for."""
    noise = data["table_3"]["cases"]["noise"]
    np.testing.assert_allclose(
        noise["complementary"]["fixed"]["sd"]["pooled"], (0.070, 0.079, 0.12), rtol=0.1
    )
    np.testing.assert_allclose(
        noise["letter"]["float"]["sd"]["pooled"], (0.070, 0.079, 0.112), rtol=0.1
    )
    assert find(data, "magnetometer and accelerometer alone: sd, noise alone")["good"]
    assert find(data, "eq. (3) as printed: gyro integrated at 100 Hz")["good"]
    assert find(data, "eq. (3) as printed violates the heading")["good"]
    assert find(data, "complementary filter: fixed point against float")["good"]
    assert find(data, "gyro error: share")["good"]
    assert find(data, "complementary on fast")["ours"][0] < 3.0
    gyro = data["table_3"]["cases"]["bias"]["gyro"]["fixed"]["sd"]["pooled"]
    np.testing.assert_allclose(gyro, (8, 38, 14), rtol=0.1)  # the bias left in


def test_a_target_fails_by_its_band_and_by_nothing_else(data):
    name = "complementary filter: sd, noise alone, fixed"
    for value, good in (
        ((0.070, 0.079, 0.112), True),
        ((0.078, 0.079, 0.112), False),
        ((0.070, 0.070, 0.112), False),
        ((0.070, 0.079, 0.13), False),
    ):
        changed = deepcopy(data)
        changed["table_3"]["cases"]["noise"]["complementary"]["fixed"]["sd"]["pooled"] = value
        found = find({"targets": targets(changed)}, name)
        assert found["good"] is good and found["good"] == all(found["passes"])
    changed = deepcopy(data)
    changed["table_3"]["cases"]["noise"]["complementary"]["fixed"]["sd"]["pooled"] = (
        0.07,
        math.nan,
        0.112,
    )
    assert not find({"targets": targets(changed)}, name)["good"]


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


def test_a_claim_that_breaks_is_not_good(monkeypatch, data):
    """The run itself says so; the parts that have no share in it are stand-ins."""
    few = tuple(m for m in ma2014.available() if m.estimator != "ekf_quaternion_vector")
    monkeypatch.setattr(
        ma2014,
        "available",
        lambda: few[:2] + tuple(m for m in few if m.key.startswith("complementary")),
    )
    monkeypatch.setattr(ma2014, "_heading_test", lambda seeds, say: data["spectra"])
    monkeypatch.setattr(ma2014, "_kinematics", lambda say: data["kinematics"])
    monkeypatch.setattr(ma2014, "_timing", lambda say: data["timing"])
    monkeypatch.setattr(
        ma2014,
        "count_mismatches",
        lambda method, log: (int(method.key == "complementary"), len(log)),
    )
    broken = ma2014.run(seed=1, runs=2)
    assert [c["good"] for c in broken["claims"]] == [False, True]
    assert broken["good"] is False


def test_page_stands_alone_and_shows_everything(data, page):
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
    assert data["command"] in page
    assert page.count('class="missed"') == sum(not t["good"] for t in data["targets"])
    assert page.count(">FAIL<") == sum(not p for t in data["targets"] for p in t["passes"])
    for label in (
        "amplitude, deg",
        "frequency, Hz",
        "heading error, deg",
        "deg, paper",
        "time from the start of the motion, s",
    ):
        assert label in page, label


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": -1}, "seed: wanted an integer of 0 to"),
        ({"seed": 1.5}, "seed: wanted an integer of 0 to"),
        ({"runs": 1}, "runs: wanted 2 to 1000, found 1"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        ma2014.run(**arguments)
