"""One draw: errors at marks, NEES and NIS of hand, angles that wrap."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight import Estimator, Input, Output, World
from boresight.sim.montecarlo.campaign import MOST_MARKS, Campaign, draws
from tests.support.drift import Constant, Mean


def test_a_draw_by_hand() -> None:
    world = Constant(70)
    (found,) = draws(Campaign(world, Mean), [7])
    world.draw(7)
    p, m, nis, errors, nees = 4.0, 0.0, 0.0, [], []
    for z in world.value + world.noise:
        nis += (z - m) ** 2 / (p + 1.0)
        m, p = m + p / (p + 1.0) * (z - m), p / (p + 1.0)
        errors.append(m - world.value)
        nees.append(errors[-1] ** 2 / p)
    marks = found["marks"]
    assert (found["seed"], found["records"], len(marks)) == (7, 70, MOST_MARKS)
    assert marks[0] == 0 and marks[-1] == 69
    assert found["errors"]["mean"] == pytest.approx(np.array(errors)[marks], abs=1e-6)
    assert found["nees"] == pytest.approx(np.array(nees)[marks], rel=1e-4)
    assert (found["freedom"], found["nis"][1]) == (1, 70)
    assert found["nis"][0] == pytest.approx(nis, rel=1e-4)


class Turned(World):
    def draw(self, seed: int) -> None:
        self.start()

    def start(self) -> None:
        self.k = 0

    def record(self, outputs: Any) -> Any:
        self.k += 1
        return None if self.k > 3 else {"a": 0.99, "b_true": -0.99}


class Through(Estimator):
    inputs = (Input("a", -1.0, 1.0, "ht"),)
    outputs = (Output("b", "ht"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"b": u.a}


def test_angles_wrap() -> None:
    (found,) = draws(Campaign(Turned(), Through), [1])
    assert found["errors"]["b"] == pytest.approx(3 * [-0.02], abs=1e-6)
    assert found["nees"] == [] and found["nis"] == [0.0, 0]
