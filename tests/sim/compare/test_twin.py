"""Float64 twins: thresholds, chunks, rounding."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.twin import RANGE_SLACK, Twin, outside, rounding_errors, twins
from boresight.sim.levels.build import Build
from tests.support.faulty import Bounded, NegativeRoot, words_and_states


class Terms(Estimator):
    """A product, and a sum whose terms cancel."""

    inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
    states = (State("y", -4.0, 4.0),)
    outputs = (Output("product"), Output("sum"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        return {"y": x.y}, {"product": u.a * u.b, "sum": 0.75 * u.a - 0.7 * u.b}


def twin_of(a: float, b: float, output: str, moved: int, word: int = 18) -> tuple[Twin, int]:
    """A twin of one update in which an output's word is ``moved`` by so many last bits."""
    build = Build(Terms(), word=word)
    (program,) = build.programs
    machine = Interpreter(program)
    inputs = [int(program.format(n).quantise(v)) for n, v in zip(program.inputs, (a, b))]  # noqa: B905
    machine.update(np.array(inputs)[:, None])
    words = [w.copy() for w in machine.values_before_commit()]
    value = program.outputs[program.output_names.index(output)]
    words[value] += moved
    return Twin(program, build.nodes[0], words), value


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize("sign", [-1, 1])
def test_so_many_last_bits_are_rounding(word: int, sign: int) -> None:
    """64, where the value is too small for its own share to count."""
    for moved, wrong in ((63, False), (65, True)):
        twin, value = twin_of(2.0**-10, 2.0**-7, "product", sign * moved, word)
        lsb = math.ldexp(1.0, -twin.program.values[value].frac)
        if word == 32:  # the twin is 2^-17: its share is less than half a bit
            assert twin.deviation(value)[1][0] * 2.0 ** (8 - word) < 0.5 * lsb
        assert twin.leaves(value).tolist() == [wrong]
    for moved, wrong in ((64, False), (65, True)):
        twin, value = twin_of(0.0, 1.0, "product", sign * moved, word)
        assert twin.leaves(value).tolist() == [wrong]


class Around(Estimator):
    """An angle that goes round, and a number that does not."""

    inputs = (Input("a", -1.0, 1.0),)
    states = (State("y", -4.0, 4.0),)
    outputs = (Output("angle"), Output("number"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        return {"y": x.y}, {"angle": ops.wrap_ht(u.a + u.a), "number": 3.0 * u.a}


@pytest.mark.parametrize(("output", "value"), [("angle", 1.0), ("number", 1.5)])
def test_only_an_angle_comes_round(output: str, value: float) -> None:
    """-1 instead of 1 half turns is right; a number that is off by 2 is not."""
    build = Build(Around())
    (program,) = build.programs
    machine = Interpreter(program)
    machine.update(np.array([[int(program.format(program.inputs[0]).quantise(0.5))]]))
    words = [w.copy() for w in machine.values_before_commit()]
    number = program.outputs[program.output_names.index(output)]
    assert abs(program.format(number).real(words[number])[0]) == value
    twin = Twin(program, build.nodes[0], words)
    assert twin.deviation(number)[0][0] < 1e-8 and twin.leaves(number).tolist() == [False]
    if output == "number":
        words[number] = words[number] - (2 << program.values[number].frac)
        assert twin.deviation(number)[0][0] == pytest.approx(2.0)
        assert twin.leaves(number).tolist() == [True]


def test_what_is_no_number_has_left(monkeypatch: pytest.MonkeyPatch) -> None:
    build = Build(NegativeRoot())
    words, states = words_and_states(build, [0.7, -2.0])
    (twin,) = twins(build.programs[0], build.nodes[0], words, states)
    value = build.programs[0].outputs[0]
    assert twin.leaves(value).tolist() == [False, True]
    errors = rounding_errors(build.programs[0], build.nodes[0], words, states)
    lsb = build.programs[0].format(value).lsb
    assert 0.0 < errors[value].largest < 64.0 * lsb  # of the first update alone
    assert errors[value].samples == 1 and errors[value].rms == errors[value].largest
    deviation = np.array([2.0, 0.0]), np.array([1.0, np.inf])  # one divided by zero
    monkeypatch.setattr(Twin, "deviation", lambda twin, value: deviation)
    errors = rounding_errors(build.programs[0], build.nodes[0], words, states)
    assert (errors[value].samples, errors[value].rms) == (1, 2.0)


@pytest.mark.parametrize(
    "x, wrong", [(-1.0, False), (1.0, False), (1.0039, False), (1.0041, True), (-1.0041, True)]
)
def test_two_thousandths_of_a_range_are_rounding(x: float, wrong: bool) -> None:
    (program,) = Build(Bounded()).programs
    said = program.values[program.states[0][0]]
    assert (said.low, said.high) == (-1.0, 1.0)
    assert outside(np.array([x]), said).tolist() == [wrong]
    ends = np.array([said.low, said.high]) + RANGE_SLACK * 2.0 * np.array([-1.0, 1.0])
    assert not outside(ends, said).any()
