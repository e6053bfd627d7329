"""Hostile inputs are what they say, within what is declared."""

from typing import Any

import numpy as np
import pytest

from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.manoeuvres import MANOEUVRES, WITHIN, hostile, manoeuvre, within


class Probe(Estimator):
    """One input of each kind."""

    inputs = (
        Input("held", -2.0, 6.0, "m", missing="hold"),
        Input("both", 0.0, 1.0, "", valid_of=("held", "zero")),
        Input("zero", -1.0, 1.0, "", missing=0.25),
        Input("plain", 10.0, 20.0, "s"),
    )


def made(name: str) -> Any:
    return within(Probe(), name, 3000, np.random.default_rng(3))


def test_which_stimuli() -> None:
    rng = np.random.default_rng(1)
    assert tuple(hostile(Probe(), 60, rng)) == WITHIN
    result = hostile(estimator("mekf"), 60, np.random.default_rng(1))
    assert tuple(result) == MANOEUVRES
    same = np.random.default_rng(1)
    assert np.array_equal(result["still"], manoeuvre("still", 60, same))
    blind = hostile(estimator_of("mekf(mag='none')"), 60, np.random.default_rng(1))
    assert tuple(blind) == MANOEUVRES
    places = [0, 1, 2, 3, 7, 8, 9]
    assert all(np.array_equal(blind[name], result[name][:, places]) for name in MANOEUVRES)


@pytest.mark.parametrize("name", WITHIN)
def test_within_the_declared_ranges(name: str) -> None:
    x = made(name)
    assert x.shape == (3000, 4) and np.array_equal(x, made(name))
    for k, declared in enumerate(Probe.inputs):
        assert x[:, k].min() >= declared.low and x[:, k].max() <= declared.high
    plain = x[:, 3]
    holds = {
        "still": (plain == 15.0).all(),
        "noise": len(np.unique(plain)) == 3000,
        "slow": np.abs(np.diff(plain)).max() < 0.3 and np.ptp(plain) > 9.0,
        "jumps": len(np.unique(plain)) == 60,
        "ends": set(plain.tolist()) == {10.0, 20.0},
        "gaps": len(np.unique(plain)) == 3000,
    }
    assert holds[name]
    assert (x[:, 1] == 1.0).all() or name == "gaps"


def test_what_is_held_is_new_in_the_first_sample() -> None:
    class Held(Estimator):
        inputs = (Input("z", 0.0, 1.0, missing="hold"), Input("new", 0.0, 1.0, valid_of="z"))

    firsts = [within(Held(), "gaps", 5, np.random.default_rng(k))[0, 1] for k in range(20)]
    assert firsts == [1.0] * 20


def test_gaps_are_read_as_declared() -> None:
    held, both, zero, _ = made("gaps").T
    missing = zero == 0.25
    assert 0.7 < missing.mean() < 0.8
    held_rows = np.r_[False, np.diff(held) == 0.0]
    assert 0.7 < held_rows.mean() < 0.8
    assert np.array_equal(both, np.where(missing | held_rows, 0.0, 1.0))


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
