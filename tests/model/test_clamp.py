"""``clamp=True`` belongs to the program: words beyond the range are clamped in every form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level


class LowPass(Estimator):
    """A low-pass of a current that is clamped."""

    inputs = (
        Input("u", -20.0, 20.0, "A", clamp=True),
        Input("v", 0.0, 3.0, "V", clamp=True),
        Input("dt", -0.25, 0.2499, "s", clamp=True),
    )
    states = (State("y", -32.0, 32.0, "A"),)
    outputs = (Output("y", "A", tolerance=1e-6), Output("v", "V"), Output("dt", "s"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + 0.5 * (u.u - x.y)
        return {"y": y}, {"y": y, "v": u.v, "dt": u.dt}


@pytest.mark.parametrize("name", ["fixed", "c", "rtl"])
def test_words_beyond_the_range_are_clamped(name: str) -> None:
    build = Build(LowPass())
    inputs = np.array([[0.0, 0.5, 0.1], *[[30.0, -3.0, 0.1], [-31.0, 3.9, 0.1]] * 2])
    level = make_level(name, build)
    try:
        out = level.run(inputs).outputs
    finally:
        level.close()
    y = 0.0
    for k, (u, v, _) in enumerate(np.clip(inputs, [-20.0, 0.0, -1.0], [20.0, 3.0, 1.0])):
        y += 0.5 * (u - y)
        assert out["y"][k] == pytest.approx(y, abs=1e-6)
        assert out["v"][k] == pytest.approx(v, abs=1e-6)


def test_a_range_that_takes_all_of_a_word_costs_nothing() -> None:
    assert not LowPass.inputs[2].beyond and LowPass.inputs[0].beyond
