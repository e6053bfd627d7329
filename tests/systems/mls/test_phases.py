"""`array_phases` against scipy's rotations; exact integers; linked to the filter in one core."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.systems.mls import estimator, phases
from boresight.systems.mls.phases import ArrayPhases

FILE, OTHER = phases.__file__, estimator.__file__


def draws(seed: int, n: int = 500) -> Any:
    """Attitudes, and beams anywhere: (n, 7)."""
    rng = np.random.default_rng(seed)
    beam = rng.normal(size=(n, 3))
    q = np.roll(Rotation.random(n, random_state=seed).as_quat(), 1, axis=1)
    return np.concatenate([q, beam / np.linalg.norm(beam, axis=1, keepdims=True)], axis=1)


def run(u: Any, elements: int, axis: str, **params: float) -> Any:
    return make_level("float", Build(ArrayPhases(elements, axis), params=[params])).run(u)


def phases(out: Any, elements: int = 64) -> Any:
    return np.stack([out[f"phase_{k}"] for k in range(elements)], axis=1)


def apart(a: Any, b: Any) -> float:
    return float(np.abs((a - b + 0.5) % 1.0 - 0.5).max())


@pytest.mark.parametrize("axis", ["y", "z"])
@pytest.mark.parametrize("elements, spacing", [(64, 0.5), (16, 0.5), (16, 0.83)])
def test_phases_of_the_turned_beam(elements: int, spacing: float, axis: str) -> None:
    u = draws(1)
    out = run(u, elements, axis, spacing=spacing).outputs
    inside = Rotation.from_quat(np.roll(u[:, :4], -1, axis=1)).inv().apply(u[:, 4:])
    wanted = spacing * inside[:, ["xyz".index(axis)]] * np.arange(elements)
    assert apart(phases(out, elements), wanted) < 1e-12
    assert out["status"].tolist() == (inside[:, 0] < 0.25).astype(float).tolist()
    assert set(ArrayPhases.status_bits) == {0}
