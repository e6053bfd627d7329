"""Potter's update against matrices of numpy."""

import numpy as np
import pytest

from boresight.model.algebra.carried import BELOW
from boresight.systems.radar.square_root import WIDE, potter, whitened


def test_whitened_rows_are_those_of_the_cholesky_factor() -> None:
    rng = np.random.default_rng(1)
    h, z = rng.normal(size=(3, 6)) * [[900.0], [400.0], [60.0]], rng.normal(size=3) * 500.0
    rows, white = whitened(h.tolist(), z.tolist(), 8192.0, 2.0**15)
    lower = np.linalg.cholesky(h @ h.T)
    assert np.array(rows) == pytest.approx(np.linalg.solve(lower, h), abs=1e-12)
    assert np.array(white) == pytest.approx(np.linalg.solve(lower, z), abs=1e-9)


@pytest.mark.parametrize("live", [True, False])
def test_potter_is_the_kalman_update(live: bool) -> None:
    rng = np.random.default_rng(2)
    s, x = 0.3 * rng.normal(size=(4, 4)), rng.normal(size=4)
    a, y = rng.normal(size=(2, 4)), rng.normal(size=2)
    result = potter(s, a, y - a @ x, np.bool_(live), np.bool_(False))
    p = s @ s.T
    inside = a @ p @ a.T + np.eye(2)
    gain = p @ a.T @ np.linalg.inv(inside)
    moved = x + [sum(t * w for t, w in pairs) for pairs in result.moves]
    after = np.array(result.root)
    if live:
        assert moved == pytest.approx(x + gain @ (y - a @ x), abs=1e-12)
        assert after @ after.T == pytest.approx(p - gain @ a @ p, abs=1e-12)
    else:
        assert (moved == x).all() and after == pytest.approx(s)
    # Innovations one after the other: their squares add up to those of both together.
    assert not result.wide
    if live:
        nu = y - a @ x
        assert np.dot(result.white, result.white) == pytest.approx(nu @ np.linalg.solve(inside, nu))


@pytest.mark.parametrize("size, used", [(0.7 * WIDE, True), (0.72 * WIDE, False)])
def test_a_row_that_is_too_wide_changes_nothing(size: float, used: bool) -> None:
    row, value = [[size, 0.0]], [1.0]
    result = potter(np.eye(2), row, value, np.bool_(True), np.bool_(False))
    assert result.wide == (not used)
    assert (np.array(result.root)[0, 0] < 0.5) == used
    assert (sum(t * w for t, w in result.moves[0]) != 0.0) == used
    begun = potter(0.1 * np.eye(2), row, value, np.bool_(True), np.bool_(True))
    assert np.array(begun.root) == pytest.approx(BELOW * np.eye(2), abs=1e-12)
