"""The experiment's result: figures, what binds, what is said meanwhile."""

import json
import math

import numpy as np
import pytest

from boresight.sim.experiments.ma2014 import experiment


def test_it_is_json_without_nan(data):
    assert json.loads(json.dumps(data, allow_nan=False))["runs"] == 3


def test_progress_names_what_runs(said, data):
    text = "\n".join(said)
    for part in ("section 3.2", "section 1.3", "eq. (3)", "integer interpreter", "schedules"):
        assert part in text


def test_the_run_shown_is_the_one_in_the_middle(data):
    heading = np.array(data["table_3"]["cases"]["C"]["complementary"]["sd_runs"])[:, 2]
    assert data["shown_seed"] - 5 == int(np.argsort(heading)[1])
    shown = np.array(data["figures"]["error_deg"]["complementary"])[:, 2]
    assert shown.std() == pytest.approx(heading[data["shown_seed"] - 5], abs=1e-4)


def test_figures_are_those_of_the_tables(result, data):
    sd = data["table_3"]["cases"]["C"]["complementary"]["fixed"]["sd"]["pooled"]
    assert result.figures["complementary: sd, C, heading, deg"] == sd[2]
    (row,) = (
        r for r in data["timing"] if (r["estimator"], r["config"]) == ("complementary", "fast")
    )
    assert result.figures["complementary on fast: cycles"] == row["cycles"] <= 175
    assert all(math.isfinite(value) for value in result.figures.values())


def test_targets_of_the_paper_are_reported_and_ours_bind(result):
    assert result.good
    binding = [t for t in result.targets if t.binding]
    assert [t.name.partition(":")[0] for t in binding] == [
        "ekf_quaternion",
        "ekf_quaternion_vector",
        "complementary",
        "complementary_as_printed",
    ]
    assert any(not t.good for t in result.targets if not t.binding)


def test_a_c_that_differs_is_not_good(monkeypatch, data):
    """The run itself says so; what was measured is a stand-in."""
    monkeypatch.setattr(experiment, "measure", lambda *more: data)
    monkeypatch.setattr(experiment, "render", lambda details, judged: "")
    for wrong, updates in ((1, 9), (0, 0)):
        counts = {"complementary": (wrong, updates)}
        monkeypatch.setattr(
            experiment, "count_mismatches", lambda method, log, c=counts: c.get(method.key, (0, 9))
        )
        broken = experiment.Ma2014().run(seed=1, runs=2, say=lambda text: None)
        failed = [t.name.partition(":")[0] for t in broken.targets if t.binding and not t.good]
        assert failed == ["complementary"] and not broken.good
