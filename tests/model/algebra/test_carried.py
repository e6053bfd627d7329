"""Sums in two words: nothing is lost to rounding, on the C too; where they begin."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model import ops
from boresight.model.algebra.carried import BELOW, carried
from boresight.model.estimator import Estimator, Input, Output, State, input_words


class Sum(Estimator):
    """Sums of products, in two words and in one."""

    inputs = (
        Input("a", -1.0, 1.0),
        Input("b", -1.0, 1.0),
        Input("new", 0.0, 1.0),
        Input("c", -1.0, 1.0),
    )
    states = (
        State("high", -8.0, 8.0 * BELOW),
        State("low", -(2.0**-12), 2.0**-12 * BELOW),
        State("plain", -8.0, 8.0 * BELOW),
    )
    outputs = (Output("high"), Output("low"), Output("plain"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        high, low = carried(x.high, x.low, [(u.a, u.b)], 8.0, u.new > 0.5)
        plain = ops.saturated(x.plain + u.c * u.b, 8.0)  # a product of three uses is a word
        after = {"high": high, "low": low, "plain": plain}
        return after, after


def test_a_carried_sum_keeps_what_one_word_rounds_away() -> None:
    n = 4000
    rng = np.random.default_rng(3)
    u = np.zeros((n, 4, 1))
    u[:, :2, 0] = 1e-4 * rng.normal(size=(n, 2)) + 2e-5
    u[:, 3] = u[:, 0]
    program = Sum().compile()
    words = input_words(program, u)[:, :, 0]
    seen = [program.format(k).real(words[:, j]) for j, k in enumerate(program.inputs)]
    out, saturated = CModel(program).update(words)
    high, low, plain = (program.format(k).real(out[:, j]) for j, k in enumerate(program.outputs))
    exact = np.cumsum(seen[0] * seen[1])
    assert np.abs(high + low - exact).max() < 1e-11 < 1e-8 < np.abs(plain - exact).max()
    assert not saturated.any()
    x = SimpleNamespace(high=1.0, low=1e-5, plain=0.0)
    after, _ = Sum().step(x, SimpleNamespace(a=0.5, b=0.5, c=0.5, new=1.0), None)
    assert after["high"] == 0.0 == after["low"]


def test_begins_where_it_is_told_and_goes_on_from_there() -> None:
    for begin, first in ((True, 0.3), (False, 0.75 + 1e-9)):
        high, low = carried(0.25, 1e-9, [0.25, (0.5, 0.5)], 1.0, begin, 0.3, [1e-7, (0.1, 0.1)])
        assert high + low == pytest.approx(first + 1e-7 + 0.01, abs=1e-15)
    high, low = carried(1.0 - 2.0**-31, 0.0, [1e-9], 1.0, False)
    assert high <= 1.0 and abs(low) <= 2.0**-15
