"""Turns of VQF against scipy's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.estimators.vqf.motion import made_vertical, rotated


def scipy_of(q: Any) -> Rotation:
    return Rotation.from_quat([*q[1:], q[0]])


@pytest.fixture
def drawn() -> Any:
    rng = np.random.default_rng(2)
    q, v = rng.normal(size=(50, 4)), rng.normal(size=(50, 3))
    return q / np.linalg.norm(q, axis=1, keepdims=True), v


def test_vectors_are_turned(drawn: Any) -> None:
    for q, v in zip(*drawn, strict=True):
        assert np.array(rotated(list(q), list(v))) == pytest.approx(scipy_of(q).apply(v))


def test_the_shortest_turn_to_the_vertical(drawn: Any) -> None:
    for q, v in zip(*drawn, strict=True):
        unit = v / np.linalg.norm(v)
        after, turn = made_vertical(list(q), *unit)
        done = scipy_of(after) * scipy_of(q).inv()
        assert done.apply(unit) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
        assert done.as_rotvec()[2] == pytest.approx(0.0, abs=1e-12)  # no heading
        assert done.magnitude() == pytest.approx(np.arccos(unit[2]))
        for w in np.eye(3):
            assert np.array(turn(w)) == pytest.approx(done.apply(w), abs=1e-12)


def test_upside_down_is_half_a_turn_about_x() -> None:
    q = [0.5, 0.5, -0.5, 0.5]
    after, turn = made_vertical(q, 0.0, 0.0, -1.0)
    done = scipy_of(after) * scipy_of(q).inv()
    assert done.as_matrix() == pytest.approx(np.diag([1.0, -1.0, -1.0]), abs=1e-12)
    assert np.array(turn([1.0, 2.0, 3.0])) == pytest.approx([1.0, -2.0, -3.0])
