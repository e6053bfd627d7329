"""P stays positive in the integers on hostile input, from small and large initial covariances."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.covariance import covariance_of, initial_covariances
from boresight.sim.fit.observe import hostile
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import Emitted
from tests.support.pages import ROOT

FILTERS = {
    f"{ROOT}/examples/kalman.py": 20_000,
    f"{ROOT}/examples/pendulum.py": 20_000,
    "battery": 20_000,
    "ekf2": 4_000,
    "ins_gnss": 6_000,
    "pmsm": 20_000,
    "ekf_quaternion": 20_000,
    "ekf_bias": 20_000,
    "mekf": 20_000,
}
#: Least eigenvalue that rounding explains, in last bits of the covariance's words.
LEAST = -4.0


def stays_positive(name: str, updates: int, steps: int) -> None:
    filter = estimator_of(name)
    level, covariance = Emitted(Build(filter)), covariance_of(filter)
    stimuli = hostile(filter, steps, np.random.default_rng(1))
    params = initial_covariances(filter)
    for values in params:
        for stimulus, inputs in stimuli.items():
            level.set_params(values)
            level.reset()
            for _ in range(max(1, updates // (len(params) * len(stimuli) * steps))):
                states = level.run(inputs).states
                assert states is not None
                p = covariance.of_words(level.program, states)
                where = f"{name}, {stimulus}, {values}"
                assert (np.diagonal(p, axis1=1, axis2=2) >= 0.0).all(), where
                assert np.linalg.eigvalsh(p[::50]).min() >= LEAST, where


@pytest.mark.parametrize("name", FILTERS)
def test_hostile_inputs(name: str) -> None:
    stays_positive(name, FILTERS[name], 1000)


@pytest.mark.soak
@pytest.mark.parametrize("name", FILTERS)
def test_ten_million_hostile_inputs(name: str) -> None:
    stays_positive(name, 10_000_000, 20_000)
