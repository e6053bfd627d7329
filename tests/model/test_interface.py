"""Declarations that contradict each other are refused, with their line."""

from __future__ import annotations

import re
from typing import Any

import pytest

from boresight.model.declarations import Input, Output, Param, State
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator

pytestmark = pytest.mark.pythons


class Leaky(Estimator):
    """A leaky integrator."""

    inputs = (Input("u", -1.0, 1.0, "m"), Input("v", -1.0, 1.0, "m"))
    params = (Param("k", 0.5, 0.0, 1.0, "", "leak"),)
    states = (State("y", -1.0, 1.0, "m"),)
    outputs = (Output("y", "m"), Output("sum", "m"))


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"inputs": 2 * Leaky.inputs}, "estimator leaky: wanted each input once, found 'u'"),
        ({"outputs": ()}, "estimator leaky: wanted an output, found none"),
        ({"urgent": 3}, "estimator leaky: wanted urgent of 0 to 2, found 3"),
        (
            {"inputs": Input("u", 0.0, 1.0)},
            "estimator leaky, inputs: wanted a tuple of Input, found one Input; write inputs = (",
        ),
        (
            {"params": (Param("k", 0.5, 0.0, 1.0), State("y", 0.0, 1.0))},
            "estimator leaky, params: wanted a tuple of Param, found a State; write params = (",
        ),
        (
            {"params": (Param("u", 0.5, 0.0, 1.0),)},
            "estimator leaky, parameter u: wanted a name that no input or state has, found 'u'",
        ),
        ({"states": (State("a b", 0.0, 1.0),)}, "estimator leaky: wanted state names of letters"),
        (
            {"inputs": (Input("f", 0.0, 1.0, "", valid_of="z"),)},
            "estimator leaky, input f: wanted valid_of names of inputs, found 'z'; choose inputs",
        ),
        (
            {"inputs": (*Leaky.inputs, Input("f", 0.0, 1.0, "", valid_of=("v", "f")))},
            "estimator leaky, input f: wanted valid_of names of inputs, found 'f'; choose u, v",
        ),
    ],
)
def test_declarations_that_contradict_each_other(changes: Any, message: str) -> None:
    odd = Leaky()
    for name, value in changes.items():
        setattr(odd, name, value)
    with pytest.raises(InputError, match=rf"^test_interface\.py, line \d+, {re.escape(message)}"):
        odd.check_declarations()


def test_sound_declarations() -> None:
    Leaky().check_declarations()
