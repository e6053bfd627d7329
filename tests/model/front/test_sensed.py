"""What sensors give: names, units, and the makers' full scales."""

import math

import pytest

from boresight.model.estimators.mekf import Mekf
from boresight.model.estimators.nine_axis import INPUTS
from boresight.model.front.sensed import ACC_COUNTS, GYRO_COUNTS, SENSED, full_scale_params


def test_full_scales() -> None:
    """ADIS16385: 300 deg/s and 5 g; HMR3300: 2 gauss."""
    assert SENSED["gy"].high == pytest.approx(math.radians(300.0), rel=1e-6)
    assert SENSED["az"].high == pytest.approx(5.0 * 9.80665, rel=1e-6)
    assert SENSED["mx"].high == 200.0
    assert (GYRO_COUNTS, ACC_COUNTS) == (24000, 20000)
    for name, sensed in SENSED.items():
        assert sensed.low == -sensed.high or name == "dt"
    assert SENSED["dt"].low < 0.0 < SENSED["dt"].high


def test_the_attitude_filters_take_all_of_it() -> None:
    assert {name: sensed.unit for name, sensed in SENSED.items()} == {
        i.name: i.unit for i in INPUTS
    }
    for i in INPUTS:
        assert i.low <= SENSED[i.name].low and SENSED[i.name].high <= i.high, i.name


def test_only_the_field_does_not_come_with_every_sample() -> None:
    assert [name for name, sensed in SENSED.items() if not sensed.always] == ["mx", "my", "mz"]


def test_parameters_that_stand_for_a_full_scale() -> None:
    found = full_scale_params(Mekf.params, rate=10.0, force=49.0)
    assert found == {
        "gyro_most_sq": pytest.approx(9.8**2),
        "force_most_sq": pytest.approx((0.98 * 49.0 - 9.80665) ** 2),
    }
    assert list(full_scale_params(Mekf.params, force=49.0)) == ["force_most_sq"]
    assert full_scale_params((), rate=10.0) == {}
    limits = {q.name: (q.low, q.high) for q in Mekf.params}
    assert full_scale_params(Mekf.params, rate=100.0)["gyro_most_sq"] == limits["gyro_most_sq"][1]
    assert full_scale_params(Mekf.params, rate=0.1)["gyro_most_sq"] == limits["gyro_most_sq"][0]
