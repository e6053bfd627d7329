"""Estimators that share states: what moves them, what corrects them, and one with its own."""

from __future__ import annotations

import functools
from typing import Any

from boresight.gateware.core import Core, build_shared_core
from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.linking import linked_estimators

STATES = (
    State("place", -8.0, 8.0, "m", initial=1.5),
    State("pace", -2.0, 2.0, "m/s", initial=-0.25),
    State("weight", 0.0, 0.5, initial=0.5),
)


class Motion(Estimator):
    """Moves the place by the pace; the weight grows."""

    inputs = (Input("dt", 0.0, 0.5, "s"), Input("push", -1.0, 1.0, "m/s"))
    states = STATES
    outputs = (Output("place", "m"),)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        place = ops.bounded(0.75 * x.place + x.pace * u.dt, -8.0, 8.0, "it leaks")
        weight = ops.minimum(x.weight + 0.01, 0.5)
        pace = ops.saturated(0.5 * x.pace + u.push, 2.0)
        return {"place": place, "pace": pace, "weight": weight}, {"place": place}


class Row(Estimator):
    """Corrects place and weight, and leaves the pace as it is."""

    inputs = (Input("seen", -8.0, 8.0, "m"), Input("trust", 0.0, 1.0), Input("unread", -1.0, 1.0))
    states, shares = STATES, "motion"
    outputs = (Output("place", "m"), Output("weight"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        gain = x.weight * u.trust
        place = ops.bounded(x.place + gain * (u.seen - x.place), -8.0, 8.0, "a mean")
        weight = ops.bounded(x.weight - x.weight * gain, 0.0, 0.5, "it shrinks")
        return {"place": place, "pace": x.pace, "weight": weight}, {
            "place": place,
            "weight": weight,
        }


class Beside(Row):
    """The same with states of its own."""

    shares = ""


@functools.cache
def shared_core(config: str = "small") -> Core:
    """A core in which the owner of the states is neither the first program nor the last."""
    made = linked_estimators([Row(), Motion(), Beside()])
    return build_shared_core([e.compile() for e in made], config)
