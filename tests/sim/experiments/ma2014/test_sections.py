"""What the sections measure: tables, statistics, spectra."""

import numpy as np

from boresight.sim.experiments.ma2014.sections import JUDGED, KALMAN, differences


def test_all_tables_and_figures_are_there(data):
    assert data["seed"] == 5 and data["shown_seed"] in (5, 6, 7)
    assert [r["ours_deg"] for r in data["table_1"]] == [list(r["end_deg"]) for r in data["table_1"]]
    for case in data["table_3"]["cases"].values():
        assert {"gyro", "mag_acc", "complementary", "letter"} <= set(case)
        assert case["mag_acc"]["fixed"] is None and case["complementary"]["fixed"]
    assert set(data["spectra"]["methods"]) >= {"gyro", "mag_acc", "complementary"}
    assert len(data["figures"]["time_s"]) == 374 * 8 + 1 == len(data["figures"]["truth_deg"])
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
        noise["complementary"]["fixed"]["sd"]["pooled"], (0.070, 0.079, 0.12), rtol=0.1
    )
    np.testing.assert_allclose(
        noise["letter"]["float"]["sd"]["pooled"], (0.070, 0.079, 0.112), rtol=0.1
    )
    gyro = data["table_3"]["cases"]["bias"]["gyro"]["fixed"]["sd"]["pooled"]
    np.testing.assert_allclose(gyro, (8, 38, 14), rtol=0.1)  # the bias left in


def test_differences_are_those_of_the_errors():
    rng = np.random.default_rng(1)
    keys = [f"{case}/{key}" for case in JUDGED for key in ("complementary", *KALMAN)]
    errors = {key: rng.standard_normal((50, 4, 3)) for key in keys}
    found = differences(errors)
    assert set(found) == {f"{case}/{key}" for case in JUDGED for key in KALMAN}
    d = errors["C/complementary"] - errors["C/ekf_quaternion"]
    row = found["C/ekf_quaternion"]
    np.testing.assert_allclose(row["sd"]["pooled"], np.sqrt(d.var(axis=0).mean(axis=0)), atol=1e-5)
    largest = np.median(np.abs(d).max(axis=0), axis=0)
    np.testing.assert_allclose(row["max"]["median"], largest, atol=1e-5)
    p95 = np.median(np.percentile(np.abs(d), 95, axis=0), axis=0)
    np.testing.assert_allclose(row["p95_abs"]["median"], p95, atol=1e-5)
