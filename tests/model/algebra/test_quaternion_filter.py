"""What the quaternion filters share."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.model.algebra.covariance import symmetric
from boresight.model.algebra.quaternion_filter import (
    FLOOR_NOISE,
    NORM_FLOOR,
    START,
    TRACE_LIMIT,
    attitude_states,
    body_covariance,
    body_turned,
    force_gate,
    moved,
    normalised,
    predicted_attitude,
    restarted,
    squared_force,
    status_word,
    update,
    update_along,
)

RNG = np.random.default_rng(2)
LEVEL = SimpleNamespace(scale=8.0, gyro_sd_x=0.1, gyro_sd_y=0.2, gyro_sd_z=0.3)


def diagonal(*variances: float) -> Any:
    return symmetric(len(variances), lambda i, j: variances[i] if i == j else 0.0)


def test_start_is_a_unit_quaternion_far_from_half_a_turn_of_any_axis() -> None:
    assert np.linalg.norm(START) == pytest.approx(1.0, abs=1e-7)
    assert [s.initial for s in attitude_states()] == list(START)
    assert min(np.abs(START)) > 0.25


def test_process_noise_stops_at_the_trace_limit_and_never_shrinks() -> None:
    u = SimpleNamespace(dt=0.01)
    small = body_covariance(diagonal(0.1, 0.1, 0.1, 0.1), [1.0, 0.0, 0.0, 0.0], u, LEVEL)
    for k, sd in enumerate((0.1, 0.2, 0.3), start=1):
        assert small[k][k] == pytest.approx(0.1 + (0.5 * sd * 0.01 * 8.0) ** 2, rel=1e-12)
    assert small[0][0] == 0.1
    full = TRACE_LIMIT / 3 + 1e-9
    large = body_covariance(diagonal(0.1, full, full, full), [1.0, 0.0, 0.0, 0.0], u, LEVEL)
    assert [large[k][k] for k in (1, 2, 3)] == pytest.approx([full] * 3, rel=1e-15)


def test_predicted_attitude_limits_the_step() -> None:
    x = SimpleNamespace(qw=1.0, qx=0.0, qy=0.0, qz=0.0)
    q, dq = predicted_attitude(x, [0.01, 0.0, 0.0])
    assert q == dq and q[1] == pytest.approx(np.sin(0.01), abs=1e-12)
    assert predicted_attitude(x, [50.0, 0.0, 0.0])[1] == predicted_attitude(x, [1.0, 0.0, 0.0])[1]


def test_updates_are_the_kalman_filters() -> None:
    root = RNG.normal(size=(4, 4))
    p = root @ root.T / 50.0
    h, r, nu = RNG.normal(size=4), 0.3, 0.2
    gains: list[Any] = []
    moves: list[Any] = []
    s = h @ p @ h + r
    update(gains, moves, list(p @ h), s, nu)
    gain = np.array(gains[0])
    assert np.allclose(np.outer(gain, gain), np.outer(p @ h, p @ h) / s, atol=1e-15)
    assert np.allclose([moved(gains, moves, k) for k in range(4)], p @ h / s * nu, atol=1e-15)


def test_normalised_and_turned_covariance() -> None:
    raw = [1.2, 0.3, -0.1, 0.2]
    q, shrink = normalised(raw)
    assert np.linalg.norm(q) == pytest.approx(1.0) and shrink == pytest.approx(
        1.0 / np.linalg.norm(raw)
    )
    p = diagonal(0.2, 0.1, 0.05, 0.02)
    turned = np.array(body_turned(p, raw, shrink, False, 0.07), dtype=float)
    turned -= FLOOR_NOISE * np.diag([0.0, 1.0, 1.0, 1.0])
    assert np.linalg.eigvalsh(turned) == pytest.approx([0.02, 0.05, 0.1, 0.2], rel=1e-12)
    fresh = np.array(body_turned(p, raw, shrink, True, 0.07), dtype=float)
    assert np.array_equal(fresh, 0.07 * np.eye(4))
    none = body_turned(diagonal(0.0, 0.1, 0.1, 0.1), [1.0, 0.0, 0.0, 0.0], 1.0, False, 0.0)
    assert none[0][0] == NORM_FLOOR


@pytest.mark.parametrize(
    ("force", "bad"), [(0.5, True), (2.0, False), (20.0, False), (40.0, True), (150.0, True)]
)
def test_force_gate(force: float, bad: bool) -> None:
    least, most = (p.default for p in force_gate(1.5))
    assert most == 1.6e4
    p = SimpleNamespace(acc_min_sq=least, acc_max_sq=900.0)
    square, outside = squared_force((force, 0.0, 0.0), p)
    assert bool(outside) is bad
    assert square == min(force**2, 2.0**14)


def test_restart_sets_the_quaternion_back() -> None:
    for dt, want in ((0.01, [0.5, 0.5, 0.5, -0.5]), (-0.01, list(START))):
        q = restarted([0.5, 0.5, 0.5, -0.5], SimpleNamespace(dt=dt))
        assert list(q) == ["qw", "qx", "qy", "qz"]
        assert [float(v) for v in q.values()] == want


def test_status_word() -> None:
    flags = {0: np.array([True, False]), 4: np.array([True, True])}
    assert status_word(flags).tolist() == [17.0, 16.0]


def test_updates_along_vectors_are_the_batch_update() -> None:
    root = RNG.normal(size=(4, 4))
    P = root @ root.T / np.trace(root @ root.T)
    rows, R = [{0: 0.6, 2: -0.8}, {1: 1.0}, {3: 0.3, 0: 0.9}], np.array([0.1, 0.2, 0.05])
    nu = np.array([0.02, -0.03, 0.05])
    gains: list[Any] = []
    moves: list[Any] = []
    for row, r, n in zip(rows, R, nu, strict=True):
        update_along(P.tolist(), gains, moves, row, r, n)
    H = np.zeros((3, 4))
    for k, row in enumerate(rows):
        H[k, list(row)] = list(row.values())
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + np.diag(R))
    assert np.array(gains).T @ moves == pytest.approx(K @ nu, abs=1e-12)
    assert P - np.array(gains).T @ gains == pytest.approx(P - K @ H @ P, abs=1e-12)


def test_updates_that_do_not_move_or_do_not_count() -> None:
    P = np.diag([0.2, 0.1])
    gains: list[Any] = []
    moves: list[Any] = []
    update_along(P.tolist(), gains, moves, {0: 1.0}, 0.1, 0.5, moving=False)
    update_along(P.tolist(), gains, moves, {1: 1.0}, 0.1, 0.5, moving=False, counting=False)
    assert moves == [0.0, 0.0]
    assert gains[0][0] ** 2 == pytest.approx(0.2**2 / 0.3) and not any(gains[1])
