"""The covariance trial: it passes the filters, and it sees one that is broken."""

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.attitude import estimator
from boresight.model.attitude.complementary import Complementary
from boresight.model.attitude.ekf_quaternion_vector import EkfQuaternionVector
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.accuracy.covariance import (
    Covariance,
    CovarianceTrial,
    covariance_of,
    covariance_trial,
    initial_covariances,
)
from boresight.sim.accuracy.manoeuvres import hostile, manoeuvre
from boresight.sim.levels.integer import words_of
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.records.segments import interpret

STEPS = 1500


def stimuli(name: str) -> Any:
    records = hostile(estimator(name), STEPS, np.random.default_rng(1))
    record = read_record(bundled("ximu_walk")).head(STEPS)
    return records | {"recorded": feed(estimator(name), record).inputs}


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
    assert t.good, str(t)
    assert t.least_eigenvalue > least_lsb
    (drift,) = t.drift.items()
    assert drift[0] == "attitude deg" and 0.0 < drift[1] < 0.005
    assert str(t).startswith(f"{name}: {t.updates} updates, 0 with a negative variance")
    assert str(t).splitlines()[0].endswith(": good")


class Greedy(EkfQuaternionVector):
    """Takes twice the square of its gain off the covariance."""

    def step(self, x: Any, u: Any, p: Any) -> Any:
        after, out = super().step(x, u, p)
        after["p22"] = ops.bounded(after["p22"] - 3e-3, -1.0, 1.0, "too much taken")
        return after, out


def test_a_covariance_that_loses_positiveness_is_seen() -> None:
    records = {"still": manoeuvre("still", 2000, np.random.default_rng(1))}
    t = covariance_trial(Greedy(), records, updates=2000, compared=10)
    assert t.least_eigenvalue < -4.0 and not t.good
    program = Greedy().compile()
    _, _, states, _ = interpret(program, words_of(program, records["still"]))
    diagonal = [k for k, s in enumerate(Greedy().states) if s.name in ("p00", "p11", "p22", "p33")]
    assert t.negative_diagonals == int((states[:, diagonal] < 0).any(axis=1).sum()) > 0


def test_verdict() -> None:
    good = CovarianceTrial("x", 1, 0, -1.0, 1, 0, {}, 1)
    assert good.good
    for count, least, said in ((1, 5.0, "1 updates with"), (0, -5.0, "least eigenvalue below -4")):
        bad = CovarianceTrial("x", 1, count, least, 1, 0, {}, 1)
        assert not bad.good and f"FAILED, {said}" in str(bad)


def test_filter_without_covariance_is_refused() -> None:
    with pytest.raises(InputError, match=r"^complementary: wanted states that are a covariance"):
        covariance_trial(Complementary(), {"still": np.zeros((5, 10))}, updates=5)


class Scalar(Estimator):
    """One variance beside a position that is named like an element."""

    inputs = (Input("dt", 0.0, 0.1, "s"), Input("z", -8.0, 8.0, "m", missing="hold"))
    params = (Param("r", 0.25, 0.01, 1.0, "m^2", "variance of a measurement"),)
    states = (State("pos", -8.0, 8.0, "m"), State("p_xx", 0.0, 4.0, "m^2", initial=1.0))
    outputs = (Output("pos", "m"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        p_xx = ops.clip(x.p_xx + 0.1 * u.dt, 0.0, 2.0)
        gain = ops.bounded(p_xx / ops.clip(p_xx + p.r, 0.01, 4.0), 0.0, 1.0, "a share")
        pos = x.pos + gain * (u.z - x.pos)
        return {"pos": pos, "p_xx": p_xx - gain * p_xx}, {"pos": pos}


def test_what_a_covariance_is() -> None:
    """A state ``pos`` has no diagonal ``poo``; an axis may be a letter."""
    assert covariance_of(Scalar()) == Covariance(("x",), ((0, 0, 1),))
    result = covariance_of(estimator("ekf_bias"))
    assert len(result.axes) == 7 and len(result.elements) == 28
    p = Covariance(("a", "b"), ((0, 0, 0), (0, 1, 1), (1, 1, 2))).of_words(
        estimator("ekf_quaternion").compile(), np.array([[4, -1, 9]])
    )
    assert p.tolist() == [[[4.0, -1.0], [-1.0, 9.0]]]


def test_any_filter_of_its_own_inputs() -> None:
    records = hostile(Scalar(), 2000, np.random.default_rng(1))
    t = covariance_trial(Scalar(), records, updates=12_000, compared=500)
    assert t.good and t.negative_diagonals == 0 and t.updates == 12_000
    assert list(t.drift) == ["pos m"] and 0.0 < t.drift["pos m"] < 1e-6
    assert str(t).endswith(f"from float64 within 500 updates: pos m {t.drift['pos m']:.3g}")


class Grown(Scalar):
    """Its variance grows by turns that are its own."""

    name = "grown"

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"pos": x.pos, "p_xx": ops.bounded(x.p_xx + 2e-4, -4.0, 4.0, "a sum")}, {
            "pos": x.pos
        }


class Shrunk(Grown):
    name, shares = "shrunk", "grown"

    def step(self, x: Any, u: Any, p: Any) -> Any:
        p_xx = ops.bounded(x.p_xx - 8e-4, -4.0, 4.0, "a sum")
        return {"pos": x.pos, "p_xx": p_xx}, {"pos": x.pos}


def test_those_that_share_a_covariance_update_it_in_turns() -> None:
    """Alone one never makes it negative, the other after 1,250 updates; in turns after 3,333."""
    records = {"any": np.zeros((2000, 2))}

    def trial(*several: Estimator, updates: int = 4000) -> CovarianceTrial:
        each = {name: [inputs] * len(several) for name, inputs in records.items()}
        return covariance_trial(several, each, updates=updates, compared=100)

    assert trial(Grown()).negative_diagonals == 0
    assert trial(Shrunk()).negative_diagonals == pytest.approx(4000 - 1250, abs=3)
    both = trial(Grown(), Shrunk(), updates=12_000)
    assert both.estimator == "grown,shrunk" and both.updates == 12_000
    assert both.negative_diagonals == pytest.approx(12_000 - 3333, abs=150)
    assert list(both.drift) == ["pos m"]
