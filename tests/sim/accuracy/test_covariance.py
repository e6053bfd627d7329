"""Covariances among states, by their names."""

from __future__ import annotations

import pytest

from boresight import Estimator, Input, Output, State
from boresight.model.errors import InputError
from boresight.sim.accuracy.covariance import covariance_of


def named(*names: str) -> Estimator:
    class Made(Estimator):
        inputs = (Input("a", -1.0, 1.0),)
        states = tuple(State(name, -1.0, 1.0) for name in names)
        outputs = (Output("a"),)

    return Made()


def test_elements_are_known_by_the_names_of_states() -> None:
    c = covariance_of(named("pos", "p00", "p01", "p11", "p02"))
    assert c.axes == ("0", "1") and c.elements == ((0, 0, 1), (0, 1, 2), (1, 1, 3))
    assert covariance_of(named("p_xx")).axes == ("x",)
    with pytest.raises(InputError, match="wanted states that are a covariance"):
        covariance_of(named("pos"))
