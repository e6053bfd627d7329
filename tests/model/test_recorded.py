"""A step and its record: equal within rounding, or refused; what a record may not show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from boresight.firmware.floating import FloatCModel
from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.recorded import check_recorded, evaluate
from boresight.model.step import Values
from boresight.model.words.interpreter import Interpreter
from tests.support.estimators import ALL
from tests.support.random_conditions import Conditional, Text, random_text

FloatArray = npt.NDArray[np.float64]

#: Expressions that one library of C holds, and updates of each.
TOGETHER, UPDATES = 40, 32
#: Quarters and ties: words hold the numbers, most products of them too.
INPUTS = np.random.default_rng(7).integers(-4, 5, (UPDATES, 2)) / 4.0
#: Where every number is a multiple of this, and every word's last bit is too, all are equal.
EXACT = 2.0**-20


class Own(Estimator):
    """An estimator of one expression."""

    inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
    params = (Param("k", 0.25, 0.0, 1.0),)
    states = (State("s", -2.0, 2.0),)
    outputs = (Output("y"),)

    def __init__(self, function: Any) -> None:
        self.function = function

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"s": 0.5 * x.s + u.a}, {"y": self.function(x, u, p)}


@pytest.mark.parametrize("name", ALL)
def test_ours_are_what_they_record(name: str) -> None:
    check_recorded(ALL[name]())


@pytest.mark.parametrize(
    "function",
    [
        lambda x, u, p: u.a if (u.a < 0.0) is (u.b < 0.0) else u.b,
        lambda x, u, p: 1.0 * isinstance(u.a, float),
        lambda x, u, p: u.a + 1e-6 * (type(p.k) is np.float64),
    ],
)
@pytest.mark.parametrize("rows", [None, np.array([[0.5, -0.5], [0.5, 0.25], [-0.5, 0.25]])])
def test_what_no_record_shows(function: Any, rows: Any) -> None:
    with pytest.raises(
        InputError, match=r"line \d+, output y of own: wanted what step comp.* numpy"
    ):
        check_recorded(Own(function), rows, {})


@pytest.mark.parametrize(
    "function",
    [
        lambda x, u, p: u.a * 0.1 * 10.0 - u.a,
        lambda x, u, p: ops.where(u.a * 0.1 * 10.0 < u.a, 1.0, 0.0),
        lambda x, u, p: 1.0 / (u.a * 0.1 * 10.0 - u.a),
        lambda x, u, p: ops.wrap_ht(1.0 + 3.0 * x.s - x.s * 3.0),
        lambda x, u, p: np.dot([x.s, u.a], [u.b, p.k]) ** 3,  # no arrays
    ],
)
def test_what_rounding_explains(function: Any) -> None:
    check_recorded(Own(function))


class Keeps(Own):
    """Keeps the last input, as traced, or as a number."""

    def __init__(self, keep: Any) -> None:
        self.last, self.keep = 0.0, keep

    def step(self, x: Any, u: Any, p: Any) -> Any:
        difference, self.last = u.a - self.last, self.keep(self.last, u.a)
        return {"s": x.s}, {"y": difference}


@pytest.mark.parametrize("keep", [lambda last, a: a, lambda last, a: last + 1.0])
def test_nothing_is_kept(keep: Any) -> None:
    for ask in (check_recorded, Estimator.compile):
        estimator = Keeps(keep)
        estimator.trace()  # as other code may have done
        with pytest.raises(
            InputError, match=r"line \d+: wanted a step that .* nothing kept in self"
        ):
            ask(estimator)


def _computed(text: Text, last: FloatArray) -> FloatArray | None:
    """Outputs in numpy, equal to those of the integers; None if it is refused."""
    estimator = Conditional(text)
    try:
        check_recorded(estimator)
        program = estimator.compile()
    except InputError as refused:
        assert "a bug" not in str(refused)
        return None
    p = Values("parameter", estimator.param_values())
    with np.errstate(all="ignore"):
        rows = zip(last, INPUTS, strict=True)
        steps = [
            estimator.step(Values("state", {"s": s}), Values("input", {"a": u[0], "b": u[1]}), p)
            for s, u in rows
        ]
    computed = np.array([float(out["y0"]) for _, out in steps])
    machine = Interpreter(program, UPDATES)
    machine.values[program.states[0][0]] = program.format(program.states[0][0]).quantise(last)
    words = [program.format(n).quantise(u) for n, u in zip(program.inputs, INPUTS.T, strict=True)]
    result = program.format(program.outputs[0])
    fixed = result.real(machine.update(np.stack(words))[0][0])
    wrong = ~(np.abs(fixed - computed) <= 1e-6 * (1.0 + np.abs(computed)))
    if wrong.any():
        trace = estimator.trace()
        leaves = {("state", "s"): last, ("input", "a"): INPUTS[:, 0], ("input", "b"): INPUTS[:, 1]}
        leaves |= {("param", i.name): np.full(UPDATES, i.default) for i in estimator.params}
        values = [np.broadcast_to(v, UPDATES) for v in evaluate(trace, leaves).values()]
        exact = np.all(np.mod(np.stack(values).astype(float), EXACT) == 0.0, axis=0)
        fine = all(v.frac >= 20 for v in program.values)
        draw = np.random.default_rng(1)
        near = [
            evaluate(trace, leaves, lambda x: x * (1 + 1e-7 * draw.uniform(-1, 1, UPDATES)))
            for _ in range(40)
        ]
        number = trace.outputs["y0"].number
        moved = np.ptp([np.broadcast_to(n[number], UPDATES) for n in near], axis=0)
        assert not np.any(wrong & exact & fine), text
        assert not np.any(wrong & (moved < 1e-6 * (1.0 + np.abs(computed)))), text
    return computed


def conditions(seeds: Sequence[int]) -> tuple[int, int]:
    """Hold the forms of random expressions together; how many were accepted and refused."""
    last = np.concatenate([[0.0], INPUTS[:-1, 0]])
    accepted: list[tuple[Text, FloatArray]] = []
    for seed in seeds:
        text = random_text(seed)
        computed = _computed(text, last)
        if computed is not None:
            accepted.append((text, computed))
    for first in range(0, len(accepted), TOGETHER):
        some = accepted[first : first + TOGETHER]
        model = FloatCModel(Conditional(*(text for text, _ in some)))
        compiled = model.update(INPUTS)
        for k, (text, computed) in enumerate(some):
            near = np.abs(compiled[:, k] - computed) <= 1e-9 * (1.0 + np.abs(computed))
            assert np.all(near | ~np.isfinite(computed)), text
    return len(accepted), len(seeds) - len(accepted)


def test_random_conditions() -> None:
    accepted, refused = conditions(range(100))
    assert accepted > 20 and refused > 20


@pytest.mark.soak
def test_random_conditions_many() -> None:
    accepted, refused = conditions(range(10_000))
    assert accepted > 2_500 and refused > 2_500
