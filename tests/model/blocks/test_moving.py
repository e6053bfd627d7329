"""Sums over a window: exact, and nothing drifts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.blocks.moving import MovingSum
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, input_words
from boresight.model.words.interpreter import Interpreter

WINDOW = MovingSum(5, -3.0, 2.0)


class Mean(Estimator):
    """Mean of five samples, and their sum."""

    inputs = (Input("u", -3.0, 2.0, "V"),)
    states = WINDOW.states("u", "V")
    outputs = (Output("mean", "V"), Output("sum", "V"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One sample."""
        after, total = WINDOW.step("u", x, u.u)
        return after, {"mean": 0.2 * total, "sum": total}


@pytest.mark.parametrize("word", [18, 32])
def test_the_sum_of_the_last_samples(word: int) -> None:
    program = Mean().compile(word=word)
    samples = np.random.default_rng(1).uniform(-3.0, 2.0, (400, 1, 1))
    words = input_words(program, samples)
    out, saturated = Interpreter(program, 1).run(words)
    mean, total = (program.format(n).real(out[:, k, 0]) for k, n in enumerate(program.outputs))
    seen = program.format(program.inputs[0]).real(words[:, 0, 0])
    wanted = np.convolve(seen, np.ones(5))[:400]
    lsb = program.format(program.outputs[1]).lsb
    assert not saturated.any() and np.abs(total - wanted).max() <= 0.5 * lsb  # rounded once
    assert np.abs(mean - 0.2 * wanted).max() <= 2.0 * program.format(program.outputs[0]).lsb
    floats = Mean().run_float(seen.reshape(-1, 1, 1)).outputs["sum"][:, 0]
    assert np.abs(floats - wanted).max() < 1e-14


def test_states_are_the_samples_in_their_range() -> None:
    states = MovingSum(3, 1.0, 4.0).states("z", "m")
    assert [(s.name, s.low, s.high, s.unit, s.initial) for s in states] == [
        ("z_1", 1.0, 4.0, "m", 1.0),
        ("z_2", 1.0, 4.0, "m", 1.0),
    ]
    assert MovingSum(2, -4.0, -1.0).states("z")[0].initial == -1.0
    with pytest.raises(InputError, match=r"^test_moving\.py, line \d+: wanted a window of 2 samp"):
        MovingSum(1, 0.0, 1.0)
