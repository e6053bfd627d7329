"""Steps that raise, or return other than what is declared: one line each."""

from __future__ import annotations

import math
import operator
import re
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.step import Values


class Leaky(Estimator):
    """A leaky integrator."""

    inputs = (Input("u", -2.0, 2.0, ""), Input("v", -2.0, 2.0, ""))
    params = (Param("rate", 0.5, 0.0, 1.0, "", ""),)
    states = (State("y", -4.0, 4.0, ""),)
    outputs = (Output("y", ""), Output("sum", ""))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = ops.bounded(x.y + p.rate * (u.u - x.y), -4.0, 4.0, "")
        return {"y": y}, {"y": y, "sum": y + u.v}


def test_step_must_return_what_is_declared() -> None:
    class Wrong(Leaky):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"y": x.y}, {"z": x.y}

    class Stateless(Leaky):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": x.y, "sum": x.y}

    class Single(Leaky):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"y": x.y}

    for wrong, message in (
        (Wrong, "step of wrong, output y, sum: wanted each declared output once: y, sum, found z"),
        (Stateless, "step of stateless, state y: wanted each declared state once: y, found none"),
        (Single, "step of single: wanted two dictionaries: next states, outputs, found a dict"),
    ):
        with pytest.raises(InputError, match=rf"^test_step\.py, line \d+, {re.escape(message)}; "):
            wrong().compile()


@pytest.mark.parametrize(
    "reason, line",
    [
        ("float() or a function of math, of a traced value; ", lambda x: math.sin(x.y)),
        ("float() or a function of math", lambda x: np.zeros(1).fill(x.y)),
        ("TypeError: 'Values' object is not subscriptable; write x.NAME", lambda x: x["y"]),
        (
            "numpy.linalg's inv of traced values; numpy.linalg takes no traced value: write "
            "ops.inverse(S, least)",
            lambda x: np.linalg.inv([[x.y]]),
        ),
        (
            "numpy's add into an array of float64; an array of float64 holds no traced value",
            lambda x: operator.iadd(np.zeros(1), np.array([x.y])),
        ),
        ("0; ", lambda x: x.y / 0.0),
        ("'z'; correct the name, or declare the state", lambda x: x.z),
        ("(1, 0); correct it", lambda x: ops.bounded(x.y, 1, 0, "")),
        ("3.0; use ops.clip for any other", lambda x: ops.saturated(x.y, 3.0)),
        ("a traced leaf in a condition; compare it; ", lambda x: (x.y < 1) & x.y),
        ("a condition as a number; ", lambda x: ops.where(x.y < 1.0, x.y < 0.0, 1.0)),
        ("a traced leaf; compare it", lambda x: ops.where(x.y, 1.0, 0.0)),
        ("numpy's sinh of a traced value; ", lambda x: np.sinh(x.y)),
    ],
)
def test_what_cannot_be_recorded_is_refused_with_its_line(reason: str, line: Any) -> None:
    class Odd(Leaky):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"y": line(x)}, {"y": x.y, "sum": x.y}

    with pytest.raises(
        InputError, match=rf"^test_step\.py, line \d+: wanted .*, found {re.escape(reason)}"
    ):
        Odd().compile()


def test_conditions_are_no_results() -> None:
    class Truth(Leaky):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"y": x.y}, {"y": x.y, "sum": x.y < 0.0}

    with pytest.raises(InputError, match=r", step of truth, output sum: wanted a number, found"):
        Truth().compile()


def test_values_by_name() -> None:
    x = Values("state", {"pos": 1.0, "_own": 2.0})
    assert (x.pos, x._own, hasattr(x, "vel"), getattr(x, "vel", 3.0)) == (1.0, 2.0, False, 3.0)
    assert vars(x) == {"pos": 1.0, "_own": 2.0}
    with pytest.raises(
        InputError, match=r"^test_step\.py, line \d+: wanted one of the declared st"
    ):
        print(x.vel)
    with pytest.raises(InputError, match=r": wanted a declared input, found 'u'; correct the name"):
        print(Values("input", {}).u)
    gains = dict.fromkeys(["kp", "ki", *(f"threshold_{k}" for k in range(20))], 1.0)
    with pytest.raises(InputError, match=r"declared parameters: 22 names, nearest: ki, .*'Ki'"):
        print(Values("parameter", gains).Ki)
