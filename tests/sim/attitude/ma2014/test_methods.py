"""The methods of the 2014 paper, and their motions."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.sim.attitude.ma2014 import experiment
from boresight.sim.attitude.ma2014.experiment import (
    count_mismatches,
    gains,
    kalman_parameters,
    run_method,
    score,
)
from boresight.sim.attitude.ma2014.world import (
    ACC_VARIANCE,
    E1,
    E2,
    GYRO_VARIANCE,
    LEAD,
    LOOP_HZ,
    MAG_VARIANCE,
    make_log,
    noise_free_log,
)
from boresight.sim.records.nine_axis import NineAxis

# --------------------------------------------------------------------------------------------------
# the paper's settings reach the estimators, and the estimators do what is known in closed form

METHODS = {m.key: m for m in experiment.METHODS}


def test_gains_of_table_4_at_8_hz():
    p = gains(rate_hz=LOOP_HZ)
    assert p["kp_pitch_per_s"] == pytest.approx(1.1312) and p["kp_heading_per_s"] == 0.8
    assert p["ki_roll_per_s2"] == pytest.approx(5e-5 * 64)


def test_table_2_reaches_the_kalman_filter():
    p = kalman_parameters()
    for axis, variance in zip("xyz", GYRO_VARIANCE, strict=True):
        assert p[f"gyro_sd_{axis}"] ** 2 == pytest.approx(variance)
    angles = np.degrees([p[f"angle_sd_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(angles, (0.1955, 0.2211, 0.468), atol=1e-3)


def test_gyro_alone_is_the_random_walk_of_table_2():
    logs = [make_log(E1, "noise", seed) for seed in range(60)]
    error = score(run_method(METHODS["gyro"], logs, ("float",))[0][0], logs)
    pooled = np.sqrt(error.var(axis=0).mean(axis=0))
    walk = np.degrees(np.sqrt(GYRO_VARIANCE)) * np.sqrt(540.0 / LOOP_HZ / 6.0)
    # the turning heading shares pitch and roll out between x and y
    walk[:2] = np.sqrt(np.mean(walk[:2] ** 2))
    np.testing.assert_allclose(pooled, walk, rtol=0.2)


def test_mag_acc_alone_has_the_noise_of_the_accelerometer():
    logs = [make_log(E2, "noise", seed) for seed in range(3)]
    error = score(run_method(METHODS["mag_acc"], logs)[0][0], logs)
    np.testing.assert_allclose(error.std(axis=0).mean(axis=0)[:2], (0.1955, 0.2211), rtol=0.05)


def test_as_printed_fails_where_the_consistent_set_passes():
    log = noise_free_log(E2, LOOP_HZ)
    for kind, worst in (("ma2014_cf", 1e-3), ("gyro", 2e-3)):
        good = score(run_method(METHODS[kind], [log], ("c",))[0][0], [log])
        bad = score(run_method(METHODS[f"{kind}_as_printed"], [log], ("c",))[0][0], [log])
        assert np.abs(good).max() < worst
        assert np.abs(bad[..., 2]).max() > 1.5


def test_figure_7_holds_against_a_kalman_filter_of_the_same_gains():
    """The paper's filters differ by 0.07 deg at most; those of other gains do not."""
    logs = [make_log(E2, "C", seed) for seed in range(1, 5)]
    angles = {
        key: run_method(METHODS[key], logs, ("c",))[0][0][LEAD:]
        for key in ("ma2014_cf", "ekf_table_4", "ekf_quaternion", "complementary")
    }

    def largest(one, other):
        apart = (angles[one] - angles[other] + 180.0) % 360.0 - 180.0
        return np.median(np.abs(apart).max(axis=0), axis=0)

    assert (largest("ma2014_cf", "ekf_table_4") < 0.07).all()
    assert largest("ma2014_cf", "ekf_quaternion")[2] > 0.2
    assert largest("complementary", "ekf_table_4")[2] > 0.2


@pytest.mark.parametrize("key", ["complementary", "ma2014_cf", "mag_acc"])
def test_fixed_point_follows_float(key):
    logs = [make_log(E2, "C", seed) for seed in (1, 2)]
    (real, none), (angles, saturated) = run_method(METHODS[key], logs)
    assert saturated == none == 0
    difference = angles - real
    assert np.abs((difference + 180) % 360 - 180).max() < 5e-4
    # every run begins afresh
    ((alone, _),) = run_method(METHODS[key], logs[1:], ("c",))
    np.testing.assert_allclose(angles[:, 1], alone[:, 0], rtol=0, atol=1e-12)


def test_a_c_model_that_differs_is_counted(monkeypatch):
    log = make_log(E2, "C", 1)
    assert count_mismatches(METHODS["complementary"], log) == 0

    def wrong(*arguments, levels, inner=experiment.run_forms, **options):
        result = inner(*arguments, levels=levels, **options)
        result[levels.index("c")][0].words[17, 2] += 1
        return result

    monkeypatch.setattr(experiment, "run_forms", wrong)
    assert count_mismatches(METHODS["complementary"], log) == 1


# -- the motions of the paper, and what each case changes in the sensors --------------------------


def noise_of(case, seed=1):
    log = NineAxis.of(make_log(E2, case, seed))
    true = NineAxis.of(noise_free_log(E2, LOOP_HZ))
    return {k: getattr(log, k) - getattr(true, k) for k in ("gyr", "acc", "mag")}


def test_noise_is_that_of_table_2():
    noise = noise_of("noise")
    np.testing.assert_allclose(noise["gyr"].var(axis=0), GYRO_VARIANCE, rtol=0.1)
    np.testing.assert_allclose(noise["acc"].var(axis=0), np.array(ACC_VARIANCE) / 12.5, rtol=0.1)
    np.testing.assert_allclose(noise["mag"].var(axis=0), MAG_VARIANCE, rtol=0.1)
    for x in noise.values():
        np.testing.assert_allclose(x.mean(axis=0), 0.0, atol=4 * x.std() / np.sqrt(len(x)))


def test_case_c_changes_gyro_and_magnetometer_alone():
    plain, c = noise_of("noise"), noise_of("C")
    moved = {key for key, x in c.items() if np.abs(x - plain[key]).max() > 1e-3}
    assert moved == {"gyr", "mag"}
