"""The paper's settings reach the estimators, and the estimators do what is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.estimators import ESTIMATORS
from boresight.sim.attitude.ma2014 import TABLE_2
from boresight.sim.experiments.ma2014 import methods
from boresight.sim.experiments.ma2014.methods import (
    count_mismatches,
    gains_per_s,
    kalman_parameters,
    run_method,
    score,
)
from boresight.sim.experiments.ma2014.world import CASES, E1, E2, LOOP_HZ, make_log, noise_free_log

METHODS = {m.key: m for m in methods.METHODS}


def test_gains_of_table_4_at_8_hz():
    p = gains_per_s()
    assert p["kp_pitch_per_s"] == pytest.approx(1.1312) and p["kp_heading_per_s"] == 0.8
    assert p["ki_roll_per_s2"] == pytest.approx(5e-5 * 64)


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if n.startswith("ekf_quaternion")])
def test_table_2_reaches_the_kalman_filters(name):
    p = kalman_parameters(name)
    for axis, variance in zip("xyz", TABLE_2.gyro, strict=True):
        assert p[f"gyro_sd_{axis}"] ** 2 == pytest.approx(variance)
    ESTIMATORS[name]().param_values(p)  # all of them legal
    if name == "ekf_quaternion":
        angles = np.degrees([p[f"angle_sd_{axis}"] for axis in "xyz"])
        np.testing.assert_allclose(angles, (0.1955, 0.2211, 0.468), atol=1e-3)


def test_gyro_alone_is_the_random_walk_of_table_2():
    logs = [make_log(E1, CASES["noise"], seed) for seed in range(60)]
    error = score(run_method(METHODS["gyro"], logs, ("float",))[0][0], logs)
    pooled = np.sqrt(error.var(axis=0).mean(axis=0))
    walk = np.degrees(np.sqrt(TABLE_2.gyro)) * np.sqrt(540.0 / LOOP_HZ / 6.0)
    # the turning heading shares pitch and roll out between x and y
    walk[:2] = np.sqrt(np.mean(walk[:2] ** 2))
    np.testing.assert_allclose(pooled, walk, rtol=0.2)


def test_mag_acc_alone_has_the_noise_of_the_accelerometer():
    logs = [make_log(E2, CASES["noise"], seed) for seed in range(3)]
    error = score(run_method(METHODS["mag_acc"], logs)[0][0], logs)
    np.testing.assert_allclose(error.std(axis=0).mean(axis=0)[:2], (0.1955, 0.2211), rtol=0.05)


def test_as_printed_fails_where_the_consistent_set_passes():
    log = noise_free_log(E2, LOOP_HZ)
    for kind, worst in (("complementary", 0.012), ("gyro", 0.002)):
        printed = {"complementary": "complementary_as_printed", "gyro": "gyro_as_printed"}[kind]
        good = score(run_method(METHODS[kind], [log], ("c",))[0][0], [log])
        bad = score(run_method(METHODS[printed], [log], ("c",))[0][0], [log])
        assert np.abs(good).max() < worst
        assert np.abs(bad[..., 2]).max() > 1.5


@pytest.mark.parametrize("key", ["complementary", "gyro"])
def test_fixed_point_follows_float(key):
    logs = [make_log(E2, CASES["C"], seed) for seed in (1, 2)]
    (real, none), (angles, saturated) = run_method(METHODS[key], logs)
    assert saturated == none == 0
    difference = angles - real
    assert np.abs((difference + 180) % 360 - 180).max() < 5e-4
    # every run begins afresh
    ((alone, _),) = run_method(METHODS[key], logs[1:], ("c",))
    np.testing.assert_allclose(angles[:, 1], alone[:, 0], rtol=0, atol=1e-12)


def test_a_c_model_that_differs_is_counted(monkeypatch):
    log = make_log(E2, CASES["C"], 1)
    assert count_mismatches(METHODS["complementary"], log) == (0, len(log))

    def wrong(*arguments, levels, inner=methods.run_forms, **options):
        found = inner(*arguments, levels=levels, **options)
        found[levels.index("c")][0].words[17, 2] += 1
        return found

    monkeypatch.setattr(methods, "run_forms", wrong)
    assert count_mismatches(METHODS["complementary"], log) == (1, len(log))


def test_errors_are_wrapped_and_begin_at_time_0():
    log = noise_free_log(E1, LOOP_HZ)
    angles = methods.truth_deg(log)[:, None] + (0.0, 359.0, -361.0)
    error = score(angles, [log])
    assert len(error) == 540 * 8 + 1
    np.testing.assert_allclose(error, np.broadcast_to((0.0, -1.0, -1.0), error.shape), atol=1e-9)
