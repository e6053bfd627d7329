"""Every estimator that a verb finds by name, the toolkit's and those of `systems/`; a small one."""

from __future__ import annotations

from functools import cache
from typing import Any

from boresight.gateware.core import Core, build_core
from boresight.model.attitude.front import FRONT
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.resolve import ESTIMATOR_GROUP, names_of_entry_points, offered
from boresight.model.words.program import Program

ALL = offered(Estimator, "estimator", ESTIMATOR_GROUP)
assert [*ALL] == names_of_entry_points(ESTIMATOR_GROUP)


@cache
def program_of(name: str, word: int = 32) -> Program:
    """A program of `ALL`, or before the filters."""
    return {**ALL, **FRONT}[name]().compile(word=word)


@cache
def core_of(name: str, config: str) -> Core:
    """The core of `program_of`."""
    return build_core(program_of(name), config)


class Leaky(Estimator):
    """A low pass whose state starts at 1."""

    inputs = (Input("u", -2.0, 2.0, "m"), Input("v", -1.0, 1.0, "m"))
    params = (Param("rate", 0.5, 0.0, 1.0),)
    states = (State("y", -2.0, 2.0, "m", 1.0),)
    outputs = (Output("y", "m"), Output("sum", "m"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + p.rate * (u.u - x.y)
        return {"y": y}, {"y": y, "sum": y - 3.0 * u.v}
