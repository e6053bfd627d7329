"""The dense filter against numerical Jacobians and exact motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.systems.mls.deck import SensorErrors, deck, records
from boresight.systems.mls.prototype import _jacobian, _picard, prototype

EXACT = SensorErrors(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)


def seen(q: np.ndarray, v: tuple[float, float, float]) -> np.ndarray:
    """C^T V with C of (23), quadratic in q."""
    w, x, y, z = q
    c = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(c).T @ np.array(v)


def test_jacobian_is_that_of_the_transposed_matrix() -> None:
    q, v = np.array([0.5, -0.3, 0.7, 0.4]), (0.6, 0.2, -0.8)
    step = 1e-6
    rows = [(seen(q + step * e, v) - seen(q - step * e, v)) / (2 * step) for e in np.eye(4)]
    h = _jacobian(q[None], v)[0]
    assert h == pytest.approx(np.array(rows).T, abs=1e-8)
    assert h @ q == pytest.approx(2.0 * seen(q, v))


def test_picard_turns_to_the_third_order() -> None:
    turn = np.array([[0.06, -0.05, 0.06]])
    start = np.array([0.1, 0.7, -0.5, 0.5])
    after = _picard(turn)[0] @ start
    exact = Rotation.from_quat(np.roll(start, -1)) * Rotation.from_rotvec(turn[0])
    q = np.roll(exact.as_quat(), 1)
    q = q * np.sign(q @ after) * np.linalg.norm(start)
    assert after == pytest.approx(q, abs=3e-6)


def test_runs_follow_exact_sensors() -> None:
    decks = [deck("table", 2.0, seed, 50.0 * seed) for seed in (1, 2)]
    rows = np.stack([records(d, s, EXACT) for s, d in enumerate(decks)], axis=1)
    start = np.stack([d.q[0] for d in decks])
    rows[0, :, 0] = 0.0
    truth = np.stack([d.q for d in decks], axis=1)
    for options in ({"p0": 1e-4}, {"p0": 0.0, "r_sd": 1e6}):
        found = prototype(rows, start, **options)
        assert np.abs(np.abs((found * truth).sum(axis=2)) - 1.0).max() < 1e-8


def test_a_wrong_start_is_found() -> None:
    what = deck("rolling", 1.5, 3)
    rows = records(what, 3, EXACT)[:, None]
    found = prototype(rows, np.array([what.q[0] + [0, 0.03, 0, 0]]), p0=1e-2)
    assert abs(found[-1, 0] @ what.q[-1]) > 1.0 - 1e-8
