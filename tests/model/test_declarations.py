"""What an estimator declares, by itself: ranges, values inside them, names."""

import math
import re
from typing import Any

import numpy as np
import pytest

from boresight.model.declarations import Input, Output, Param, State
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator

pytestmark = pytest.mark.pythons


class Reciprocal(Estimator):
    """1 / s."""

    inputs = (Input("z", -1.0, 1.0),)
    outputs = (Output("y"),)

    def __init__(self, state: State) -> None:
        self.states = (state,)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"s": x.s}, {"y": 1.0 / x.s}


def test_the_ends_of_a_range_belong_to_it() -> None:
    for value in (-1.0, 1.0):
        Param("k", value, -1.0, 1.0)
        State("x", -1.0, 1.0, initial=value)
        Input("z", -1.0, 1.0, missing=value)
    Input("z", -1.0, 1.0, missing="hold")
    assert Output("y", tolerance=0.0).tolerance == 0.0


@pytest.mark.parametrize(
    ("valid_of", "flags"), [((), ()), ("gx", ("gx",)), (("gx", "gy"), ("gx", "gy"))]
)
def test_inputs_whose_validity_one_tells(valid_of: Any, flags: tuple[str, ...]) -> None:
    assert Input("new", 0.0, 1.0, valid_of=valid_of).flags == flags


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: Param("k", 2.0, 0.0, 1.0), "parameter k: wanted default in [0, 1], found 2.0; "),
        (lambda: State("x", -1.0, 1.0, "m", 3.0), "state x: wanted initial value in [-1, 1]"),
        (lambda: Input("z", 1.0, 1.0, "m"), "input z: wanted a finite range with low < high"),
        (lambda: Output("y", "m\n"), r"output y: wanted a unit such as m/s^2 or uT, found 'm\n'"),
        (lambda: Input("z", 0.0, math.inf, "m"), "input z: wanted a finite range"),
        (lambda: Input("z", 0.0, 1.0, "m", missing=2.0), "input z: wanted missing in [0, 1]"),
        (lambda: Input("z", 0.0, 1.0, clamp="no"), "input z: wanted clamp: True or False"),
        (lambda: Input("z", 0.0, 1.0, "m", missing="last"), "input z: wanted missing=NUMBER"),
        (
            lambda: Input("new", 0.0, 1.0, valid_of=3),
            "input new: wanted valid_of: a text or a tuple",
        ),
        (lambda: State("x", -(10**400), 1, "m"), "state x: wanted a finite range"),
        (lambda: State("x", -1.0, 1.0, "m", "0"), "state x: wanted initial: a number, found '0'"),
        (lambda: Output("y", "m", share=None), "output y: wanted share: a number, found none"),
        (lambda: Output("y", "m", tolerance=-1.0), "output y: wanted a tolerance of 0 or more"),
        (
            lambda: Output("y", "flags", tolerance=0.1),
            "output y: wanted no tolerance of flags, which are",
        ),
        (lambda: Output("y", "m", tolerance=math.nan), "output y: wanted a tolerance of 0 or more"),
    ],
)
def test_declarations_that_contradict_themselves(make: Any, message: str) -> None:
    with pytest.raises(
        InputError, match=rf"^test_declarations\.py, line \d+, {re.escape(message)}"
    ):
        make()


def test_numbers_of_numpy_are_numbers() -> None:
    half = np.sqrt(np.float64(0.25))
    state = State("s", -half, np.int64(1), "m", initial=np.float32(0.25))
    assert repr(state) == repr(State("s", -0.5, 1, "m", initial=0.25, line=state.line))
    with pytest.raises(InputError, match=r"excludes 0, found s in \[-0.5, 1\]; divide by ops"):
        Reciprocal(state).compile()
