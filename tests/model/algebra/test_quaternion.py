"""Quaternions and the filters' steps on them."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.algebra.angles import euler_ht
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
