"""Hostile inputs are what they say, within what is declared."""

from typing import Any

import numpy as np
import pytest

from boresight.model.estimator import Estimator, Input
from boresight.sim.accuracy.manoeuvres import WITHIN, within


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
