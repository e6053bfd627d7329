"""P stays positive in the integers, whatever comes."""

from __future__ import annotations

import pytest

import boresight
from tests.support.pages import ROOT

EKF2 = f"{ROOT}/systems/ekf2/estimator.py"
FILTERS = {
    f"{ROOT}/examples/kalman.py": 20_000,
    f"{ROOT}/examples/pendulum.py": 20_000,
    "battery": 20_000,
    "ekf2": 4_000,
    f"{EKF2}:Ekf2Motion,{EKF2}:Ekf2Row": 4_000,
    "ins_gnss": 6_000,
    "pmsm": 20_000,
}


@pytest.mark.parametrize("name", FILTERS)
def test_hostile_inputs(name: str) -> None:
    updates = FILTERS[name]
    trial = boresight.covariance(name, updates=updates, steps=updates // 4)
    assert trial.good and trial.negative_diagonals == 0, str(trial)


@pytest.mark.soak
@pytest.mark.parametrize("name", FILTERS)
def test_ten_million_hostile_inputs(name: str) -> None:
    trial = boresight.covariance(name, updates=10_000_000)
    assert trial.good and trial.negative_diagonals == 0, str(trial)
