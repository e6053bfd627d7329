"""The covariance trial: it passes the filters, and it sees one that is broken."""

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimators import estimator
from boresight.model.estimators.complementary import Complementary
from boresight.model.estimators.ekf_quaternion_vector import EkfQuaternionVector
from boresight.sim.accuracy.covariance_trial import (
    MANOEUVRES,
    CovarianceTrial,
    covariance_trial,
    manoeuvre,
)
from boresight.sim.attitude.feed import inputs_of
from boresight.sim.attitude.log import read_log
from boresight.sim.records.bundled import bundled
from boresight.verbs.covariance import initial_covariances

STEPS = 1500


def stimuli(name: str) -> Any:
    records = {m: manoeuvre(m, STEPS, np.random.default_rng(1)) for m in MANOEUVRES}
    records["recorded"] = inputs_of(estimator(name), read_log(bundled("ximu_walk")))[:STEPS]
    return records


# A P0 of 1e-8 rad^2 is 5 LSB in mekf, which has no scale.
@pytest.mark.parametrize(
    ("name", "least_lsb"),
    [("ekf_quaternion", 10.0), ("ekf_quaternion_vector", 10.0), ("ekf_bias", 10.0), ("mekf", 4.0)],
)
def test_filters_stay_positive_and_with_float(name: str, least_lsb: float) -> None:
    """P0 from 1e-8 to 1 rad^2; the long version is the same with 10,000,000 updates."""
    t = covariance_trial(
        estimator(name),
        stimuli(name),
        updates=90_000,
        compared=200,
        params=initial_covariances(estimator(name))[::2],
    )
    assert t.updates >= 90_000 and t.eigenvalues_checked > 1500
    assert t.good, t.line()
    assert t.least_eigenvalue > least_lsb
    assert t.drift_deg < 0.005
    assert t.line().startswith(f"{name}: {t.updates} updates, 0 with a negative variance")


class Greedy(EkfQuaternionVector):
    """Takes twice the square of its gain off the covariance."""

    def step(self, x: Any, u: Any, p: Any) -> Any:
        after, out = super().step(x, u, p)
        after["p22"] = ops.bounded(after["p22"] - 3e-3, -1.0, 1.0, "too much taken")
        return after, out


def test_a_covariance_that_loses_positiveness_is_seen() -> None:
    records = {"still": manoeuvre("still", 2000, np.random.default_rng(1))}
    t = covariance_trial(Greedy(), records, updates=2000, compared=10)
    assert t.negative_diagonals > 0 and t.least_eigenvalue < -4.0 and not t.good


def test_verdict() -> None:
    good = CovarianceTrial("x", 1, 0, -1.0, 1, 0, 0.0, 1)
    assert good.good
    assert not CovarianceTrial("x", 1, 1, 5.0, 1, 0, 0.0, 1).good
    assert not CovarianceTrial("x", 1, 0, -5.0, 1, 0, 0.0, 1).good


def test_filter_without_covariance_is_refused() -> None:
    with pytest.raises(InputError, match=r"^complementary: .*Kalman"):
        covariance_trial(Complementary(), {"still": np.zeros((5, 10))}, updates=5)


@pytest.mark.parametrize("name", MANOEUVRES)
def test_manoeuvres_are_what_they_say(name: str) -> None:
    x = manoeuvre(name, 3000, np.random.default_rng(2))
    assert x.shape == (3000, 10) and np.isfinite(x).all()
    force, field = (np.linalg.norm(x[:, k], axis=1) for k in (slice(7, 10), slice(4, 7)))
    holds = {
        "still": np.abs(x[:, 1:4]).max() < 0.2,
        "tumble": np.ptp(x[:, 7]) > 10.0,
        "spin": np.abs(x[:, 1:4]).min() > 15.0 or np.abs(x[:, 1:4]).max() > 30.0,
        "blows": force.max() > 100.0,
        "free fall": (force < 2.0).mean() > 0.2,
        "magnet": field.max() > 150.0,
        "gaps": (field == 0.0).mean() > 0.8,
        "restarts": (x[:, 0] < 0.0).any(),
        "uneven": np.ptp(x[:, 0]) > 0.2,
    }
    assert holds[name]
    assert np.array_equal(x, manoeuvre(name, 3000, np.random.default_rng(2)))


def test_unknown_manoeuvre_is_refused() -> None:
    with pytest.raises(InputError, match=r"^manoeuvre: .*'loop'"):
        manoeuvre("loop", 5, np.random.default_rng(1))
