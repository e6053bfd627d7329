"""Shared by the tests of the boards: small cores."""

from collections.abc import Callable

import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State


class Leaky(Estimator):
    """y' = y + gain (u - v), the smallest estimator that has one of everything."""

    name = "leaky"
    summary = "leaky integral of a difference"
    inputs = (Input("u", -1.0, 1.0, ""), Input("v", -1.0, 1.0, ""))
    params = (Param("gain", 0.5, -1.0, 1.0, "", "how fast it follows"),)
    states = (State("y", -4.0, 4.0, ""),)
    outputs = (Output("y", ""), Output("step", ""), Output("sum", ""))
    urgent = 1

    def step(self, x, u, p):
        step = p.gain * (u.u - u.v)
        y = ops.saturated(x.y + step, 4.0)
        return {"y": y}, {"y": y, "step": step, "sum": u.u + u.v}


@pytest.fixture(scope="session")
def leaky() -> Core:
    """A tiny core."""
    return build_core(Leaky().compile(), "small")


class Growing(Leaky):
    """y' = y + gain (u + v): other words from the same records."""

    name = "growing"

    def step(self, x, u, p):
        step = p.gain * (u.u + u.v)
        y = ops.saturated(x.y + step, 4.0)
        return {"y": y}, {"y": y, "step": step, "sum": u.u - u.v}


@pytest.fixture(scope="session")
def both() -> Core:
    """Two tiny programs in one core."""
    return build_shared_core([Leaky().compile(), Growing().compile()], "small")


@pytest.fixture(scope="session")
def leaky_of() -> Callable[[str, int], Core]:
    """The tiny core of any configuration and word."""
    return lambda config, word: build_core(Leaky().compile(word=word), config)
