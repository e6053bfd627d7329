"""The motions of the paper, and what each case changes in the sensors."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.sim.attitude.ma2014 import TABLE_1, TABLE_2, TABLE_3
from boresight.sim.attitude.rotation import quaternion_to_euler
from boresight.sim.experiments.ma2014.world import (
    CASES,
    E1,
    E2,
    LEAD,
    LOOP_HZ,
    make_log,
    noise_free_log,
)
from boresight.sim.records.nine_axis import NineAxis


def test_stages_end_where_table_1_says():
    np.testing.assert_allclose(np.degrees(E2.ends), [row["end_deg"] for row in TABLE_1], atol=1e-9)
    assert E2.seconds == 374.0
    angles = np.degrees(E2.stages(np.arange(0.0, 374.0, 0.05))[0])
    np.testing.assert_allclose(np.abs(angles).max(axis=0), 15.0, atol=1e-3)


def test_euler_angles_differ_from_stage_angles_as_the_specification_says():
    t = np.arange(0.0, 374.0, 0.05)
    off = np.degrees(quaternion_to_euler(E2.attitude(t)) - E2.stages(t)[0])
    np.testing.assert_allclose(np.abs(off).max(axis=0), (4.3, 4.4, 0.5), atol=0.05)


def test_heading_swings_90_times():
    assert E1.seconds == 540.0
    heading = np.degrees(E1.stages(np.arange(0.0, 540.0, 0.01))[0][:, 2])
    assert heading.max() == pytest.approx(20.0) and heading.min() == pytest.approx(-20.0)
    assert int(((heading[:-1] < 0) & (heading[1:] >= 0)).sum()) == pytest.approx(90, abs=1)


def noise_of(case, seed=1):
    log = NineAxis.of(make_log(E2, CASES[case], seed))
    true = NineAxis.of(noise_free_log(E2, LOOP_HZ))
    return {k: getattr(log, k) - getattr(true, k) for k in ("gyr", "acc", "mag")}


def test_noise_is_that_of_table_2():
    noise = noise_of("noise")
    np.testing.assert_allclose(noise["gyr"].var(axis=0), TABLE_2.gyro, rtol=0.1)
    np.testing.assert_allclose(
        noise["acc"].var(axis=0), np.array(TABLE_2.accelerometer) / 12.5, rtol=0.1
    )
    np.testing.assert_allclose(noise["mag"].var(axis=0), TABLE_2.magnetometer, rtol=0.1)
    for x in noise.values():
        np.testing.assert_allclose(x.mean(axis=0), 0.0, atol=4 * x.std() / np.sqrt(len(x)))


def test_each_case_changes_its_sensor_alone():
    plain = noise_of("noise")
    for case, changed in (("misalignment", {"gyr"}), ("soft_iron", {"mag"}), ("C", {"gyr", "mag"})):
        now = noise_of(case)
        for key, x in now.items():
            moved = np.abs(x - plain[key]).max() > 1e-3
            assert moved == (key in changed), (case, key)
    late, c = noise_of("latency"), noise_of("C")
    assert np.abs(late["acc"] - c["acc"]).max() > 0.05
    np.testing.assert_array_equal(late["mag"], c["mag"])
    left = noise_of("bias")["gyr"] - c["gyr"]
    np.testing.assert_allclose(left.mean(axis=0), TABLE_2.gyro_bias, atol=1e-9)


def test_soft_iron_is_the_ellipse_it_says():
    log, plain = (NineAxis.of(make_log(E1, CASES[case], 1)) for case in ("soft_iron", "noise"))
    true = NineAxis.of(noise_free_log(E1, LOOP_HZ)).mag
    change = log.mag - plain.mag
    np.testing.assert_allclose(change, true * (0.01, -0.01, 0.0), atol=0.03)  # counts: 0.022 uT


def test_samples_at_rest_come_first():
    log = NineAxis.of(make_log(E2, CASES["noise"], 1))
    assert len(log) == LEAD + 374 * 8 + 1 and log.t[LEAD] == 0.0
    np.testing.assert_array_equal(np.abs(log.q[: LEAD + 1, 0]), 1.0)


def test_tables_have_three_axes():
    assert all(len(row) == 3 for row in TABLE_3.values())
