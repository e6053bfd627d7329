"""Every estimator that a verb finds by name, the toolkit's and those of `systems/`; a small one."""

from __future__ import annotations

from typing import Any

from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.resolve import ESTIMATOR_GROUP, names_of_entry_points, offered

ALL = offered(Estimator, "estimator", ESTIMATOR_GROUP)
assert [*ALL] == names_of_entry_points(ESTIMATOR_GROUP)


class Leaky(Estimator):
    """A low pass whose state starts at 1."""

    inputs = (Input("u", -2.0, 2.0, "m"), Input("v", -1.0, 1.0, "m"))
    params = (Param("rate", 0.5, 0.0, 1.0),)
    states = (State("y", -2.0, 2.0, "m", 1.0),)
    outputs = (Output("y", "m"), Output("sum", "m"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + p.rate * (u.u - x.y)
        return {"y": y}, {"y": y, "sum": y - 3.0 * u.v}
