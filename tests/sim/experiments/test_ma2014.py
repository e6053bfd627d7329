"""The whole experiment, small: its fields, its claims."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments import ma2014


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
