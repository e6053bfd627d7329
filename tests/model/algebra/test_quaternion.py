"""Quaternions and the filters' steps on them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.algebra.angles import euler_ht
from boresight.model.algebra.covariance import BELOW_ONE, symmetric
from boresight.model.algebra.quaternion import (
    conjugate_turn,
    cross,
    increment,
    left_matrix,
    matrix,
    multiply,
    of_angles,
    right_matrix,
    scaled_matrix,
    small_turn,
    times_vector,
    turn,
    vector_times,
)
from boresight.model.algebra.quaternion_filter import (
    FLOOR_NOISE,
    P0_MOST,
    QUATERNION_LIMIT,
    START,
    attitude_states,
    body_covariance,
    body_turned,
    correction_of,
    force_gate,
    initial_variance,
    is_full,
    moved,
    normalised,
    predicted_attitude,
    restarted,
    squared_force,
    status_word,
    update,
    update_along,
)
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_multiply,
    quaternion_normalise,
    quaternion_to_euler,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)

# --------------------------------------------------------------------------------------------------
# quaternion algebra on scalars against `sim.rotations.rotation` on arrays, and in fixed point

RNG = np.random.default_rng(5)
Q = quaternion_normalise(RNG.normal(size=(500, 4)))
P = quaternion_normalise(RNG.normal(size=(500, 4)))


def wrapped(x: Any) -> Any:
    return (x + 1.0) % 2.0 - 1.0


def test_products_and_matrices() -> None:
    want = quaternion_multiply(P, Q)
    assert np.allclose(np.stack(multiply(P.T, Q.T), 1), want, atol=1e-15)
    for m, q in ((np.array(left_matrix(P.T)), Q), (np.array(right_matrix(Q.T)), P)):
        assert np.allclose(np.einsum("ijn,nj->ni", m, q), want, atol=1e-15)
    c = np.array(matrix(Q.T))
    assert np.allclose(np.moveaxis(c, 2, 0), quaternion_to_matrix(Q), atol=1e-14)
    long = 1.5 * Q.T  # bounded is for what cannot be: it does not limit float64
    limited = np.array(matrix(long, unit=False))
    assert np.abs(matrix(long)).max() > 1.5
    assert np.allclose(limited, np.clip(np.array(matrix(long)), -1.0, 1.0), atol=1e-14)
    v = RNG.normal(size=(3, 500))
    assert np.allclose(conjugate_turn(c, turn(c, v)), v, atol=1e-14)
    assert np.allclose(np.stack(cross(v, c[0]), 1), np.cross(v.T, c[0].T), atol=1e-14)


@pytest.mark.parametrize(("angle", "bound"), [(0.1, 1e-10), (1.0, 1e-4)])
def test_increment_is_the_turn_by_twice_its_argument(angle: float, bound: float) -> None:
    half = RNG.normal(size=(200, 3))
    half *= 0.5 * angle / np.linalg.norm(half, axis=1, keepdims=True)
    want = rotation_vector_to_quaternion(2.0 * half)
    error = np.abs(np.stack(increment(half.T), 1) - want).max()
    assert 1e-3 * bound < error < bound


def test_a_short_increment_is_no_longer_than_one() -> None:
    half = RNG.uniform(-1.0, 1.0, size=(500, 3))
    y = (half * half).sum(axis=1)
    square = (np.stack(increment(half.T, short=True), 1) ** 2).sum(axis=1)
    assert np.allclose(square, 1.0 - y**4 / 1728.0 + y**5 / 20736.0, atol=1e-14)
    assert square.max() <= 1.0 < (np.stack(increment(half.T), 1) ** 2).sum(axis=1).max()
    w, x, *_ = increment(np.array([0.3, 0.0, 0.0]), short=True)
    assert 0.3 - np.arctan2(x, w) == pytest.approx(0.3**5 / 720.0, rel=0.05)


def test_products_with_vectors() -> None:
    v = RNG.normal(size=(3, 500))
    pure = np.concatenate([np.zeros((1, 500)), v])
    assert np.allclose(times_vector(Q.T, v), multiply(Q.T, pure), atol=1e-14)
    assert np.allclose(vector_times(v, Q.T), multiply(pure, Q.T), atol=1e-14)


def test_small_turn_to_the_last_digit() -> None:
    """What is added up has no error at 2^-7 rad; the product, one of y^2."""
    angle = RNG.uniform(-(2.0**-7), 2.0**-7, (3, 500))
    want = quaternion_multiply(Q, rotation_vector_to_quaternion(angle.T))
    after, step = (np.stack(part, 1) for part in small_turn(Q.T, angle, 2.0**-7))
    assert np.abs(Q + step - want).max() < 1e-15
    assert 1e-12 < np.abs(after - want).max() < 5e-9
    _, nearly = small_turn(Q.T, angle, 2.0**-7, nearly=0.999 * angle)
    off = np.abs(np.stack(nearly, 1) - step).max()
    assert 1e-9 < off < 1e-7  # of the cosine: its y is another one


def test_of_angles() -> None:
    q = np.array(of_angles(66.0, 2.0, -100.0))
    want = Rotation.from_euler("ZXY", [-100.0, 66.0, 2.0], degrees=True).as_quat()[[3, 0, 1, 2]]
    assert q * np.sign(q @ want) == pytest.approx(want, abs=1e-15)


def test_scaled_matrix_of_any_length() -> None:
    q = Q.T * np.linspace(0.4, 1.9, len(Q))
    wanted = np.array(matrix(Q.T)) * (q * q).sum(axis=0)
    assert np.abs(np.array(scaled_matrix(q)) - wanted).max() < 1e-14


def test_euler_angles_at_any_attitude_and_sign() -> None:
    want = quaternion_to_euler(Q) / np.pi
    for sign in (1.0, -1.0):
        result = euler_ht(sign * Q.T)
        for k in range(3):
            assert np.abs(wrapped(result[k] - want[:, k])).max() < 1e-14


def test_euler_angles_of_a_scaled_quaternion() -> None:
    norm = RNG.uniform(0.7, 1.3, 500)
    result = euler_ht((Q * norm[:, None]).T, 1.0 / norm)
    assert np.abs(wrapped(result[0] - euler_ht(Q.T)[0])).max() < 1e-14


#: Euler angles [rad]: axes, poles, and beside the poles.
SPECIAL = np.array(
    [
        [t, g, p]
        for t in (0.0, 0.5, 1.5, np.pi / 2, -np.pi / 2, 1e-9)
        for g in (0.0, np.pi / 2, -3.0)
        for p in (0.0, np.pi, -np.pi / 2, 2.0)
    ]
)


def test_euler_angles_at_axes_and_poles_give_the_attitude_back() -> None:
    q = euler_to_quaternion(SPECIAL)
    result = np.pi * np.stack(euler_ht(q.T), 1)
    back = np.abs((euler_to_quaternion(result) * q).sum(1))
    assert np.abs(1.0 - back).max() < 1e-12


def test_euler_angles_in_fixed_point(trace: Any) -> None:
    """As an attitude within 3e-7 rad, and 4e-5 rad at the poles: half the bits."""
    t = trace(lambda *q: euler_ht(q), [(-1.0, 1.0)] * 4)
    for q, bound in ((Q, 3e-7), (euler_to_quaternion(SPECIAL), 4e-5)):
        fixed, _, saturated = t.run(*q.T)
        assert not saturated.any()
        back = euler_to_quaternion(np.pi * np.stack(fixed, 1))
        back *= np.sign((back * q).sum(1, keepdims=True))
        assert 2.0 * np.linalg.norm(back - q, axis=1).max() < bound


# -- what the quaternion filters share ------------------------------------------------------------

QUATERNION_FILTER_RNG = np.random.default_rng(2)
LEVEL = SimpleNamespace(scale=8.0, gyro_sd_x=0.1, gyro_sd_y=0.2, gyro_sd_z=0.3)


def diagonal(*variances: float) -> Any:
    return symmetric(len(variances), lambda i, j: variances[i] if i == j else 0.0)


def test_start_is_a_unit_quaternion_far_from_half_a_turn_of_any_axis() -> None:
    assert np.linalg.norm(START) == pytest.approx(1.0, abs=1e-7)
    assert [s.initial for s in attitude_states()] == list(START)
    assert min(np.abs(START)) > 0.25


def test_process_noise_stops_at_the_trace_limit_and_never_shrinks() -> None:
    u = SimpleNamespace(dt=0.01)
    p = diagonal(0.1, 0.1, 0.1, 0.1)
    assert not is_full(p)
    small = body_covariance(p, [1.0, 0.0, 0.0, 0.0], u, LEVEL, is_full(p))
    for k, sd in enumerate((0.1, 0.2, 0.3), start=1):
        assert small[k][k] == pytest.approx(0.1 + (0.5 * sd * 0.01 * 8.0) ** 2, rel=1e-12)
    assert small[0][0] == 0.1
    most = QUATERNION_LIMIT / 4 + 1e-9
    p = diagonal(most, most, most, most)
    assert is_full(p)
    large = body_covariance(p, [1.0, 0.0, 0.0, 0.0], u, LEVEL, is_full(p))
    assert [large[k][k] for k in (1, 2, 3)] == pytest.approx([most] * 3, rel=1e-15)


def test_the_initial_variance_of_four_states_is_below_one() -> None:
    for sd, wanted in ((0.1, 0.16), (1.0, P0_MOST)):
        p = SimpleNamespace(p0_sd=sd, scale=8.0)
        assert initial_variance(p) == pytest.approx(wanted, rel=1e-12)
    assert 4.0 * P0_MOST < BELOW_ONE


def test_predicted_attitude_limits_the_step() -> None:
    x = SimpleNamespace(qw=1.0, qx=0.0, qy=0.0, qz=0.0)
    q, dq = predicted_attitude(x, [0.01, 0.0, 0.0])
    assert q == dq and q[1] == pytest.approx(np.sin(0.01), abs=1e-12)
    assert predicted_attitude(x, [50.0, 0.0, 0.0])[1] == predicted_attitude(x, [1.0, 0.0, 0.0])[1]


def test_updates_are_the_kalman_filters() -> None:
    root = QUATERNION_FILTER_RNG.normal(size=(4, 4))
    p = root @ root.T / 50.0
    h, r, nu = QUATERNION_FILTER_RNG.normal(size=4), 0.3, 0.2
    gains: list[Any] = []
    moves: list[Any] = []
    s = h @ p @ h + r
    update(gains, moves, list(p @ h), s, nu)
    gain = np.array(gains[0])
    assert np.allclose(np.outer(gain, gain), np.outer(p @ h, p @ h) / s, atol=1e-15)
    assert np.allclose([moved(gains, moves, k) for k in range(4)], p @ h / s * nu, atol=1e-15)


def test_normalised_and_turned_covariance() -> None:
    raw = [1.2, 0.3, -0.1, 0.2]
    unit, shrink = normalised(raw)
    assert np.linalg.norm(unit) == pytest.approx(1.0)
    assert shrink == pytest.approx(1.0 / np.linalg.norm(raw))
    p = diagonal(0.2, 0.1, 0.05, 0.02)
    turned = np.array(body_turned(p, raw, False, False, 0.07), dtype=float)
    turned -= FLOOR_NOISE * np.eye(4)
    assert np.linalg.eigvalsh(turned) == pytest.approx([0.02, 0.05, 0.1, 0.2], rel=1e-12)
    full = np.array(body_turned(p, raw, True, False, 0.07), dtype=float)
    assert np.abs(full - turned).max() < 1e-16
    fresh = np.array(body_turned(p, raw, False, True, 0.07), dtype=float)
    assert np.array_equal(fresh, 0.07 * np.eye(4))


def test_a_correction_is_no_longer_than_its_squares() -> None:
    far = correction_of([9.0, -9.0, 9.0, 0.5])
    assert far == [2.0, -1.0, 1.0, 0.5]
    _, shrink = normalised(correction_of([9.0] * 4))
    assert shrink == pytest.approx(7.0**-0.5)


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
    root = QUATERNION_FILTER_RNG.normal(size=(4, 4))
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
