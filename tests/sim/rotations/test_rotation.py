"""`sim.rotations.rotation` against scipy.spatial.transform, closed forms and its own inverses."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.rotations import rotation as attitude

#: A few rounding errors of float64.
TIGHT = 4e-15

angle = st.floats(-10.0, 10.0)


def random_quaternions(count: int, seed: int) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(count, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def random_euler(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    limits = np.array([np.pi / 2, np.pi, np.pi])
    return rng.uniform(-limits, limits, size=(count, 3))


def scipy_of(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def scipy_of_euler(euler: np.ndarray) -> Rotation:
    return Rotation.from_euler("ZXY", np.asarray(euler)[..., [2, 0, 1]])


def same_up_to_sign(p: np.ndarray, q: np.ndarray, atol: float = TIGHT) -> None:
    sign = np.where(np.sum(p * q, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    np.testing.assert_allclose(p, sign * q, rtol=0, atol=atol)


def test_multiply_agrees_with_scipy() -> None:
    p, q = random_quaternions(200, 1), random_quaternions(200, 2)
    same_up_to_sign(
        attitude.quaternion_multiply(p, q), (scipy_of(p) * scipy_of(q)).as_quat(scalar_first=True)
    )


@pytest.mark.parametrize(
    "function",
    [
        attitude.quaternion_normalise,
        attitude.quaternion_to_matrix,
        attitude.quaternion_to_euler,
        attitude.quaternion_to_rotation_vector,
        lambda q: attitude.rotate(q, np.ones(3)),
    ],
)
def test_zero_norm_is_refused(function: Callable[..., np.ndarray]) -> None:
    with pytest.raises(InputError, match=r"^q must have a norm above zero, not 0\.0: .*$"):
        function([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])


def test_quaternion_to_matrix_agrees_with_scipy_at_any_norm() -> None:
    q = random_quaternions(200, 3)
    expected = scipy_of(q).as_matrix()
    np.testing.assert_allclose(attitude.quaternion_to_matrix(q), expected, rtol=0, atol=TIGHT)
    np.testing.assert_allclose(attitude.quaternion_to_matrix(7 * q), expected, rtol=0, atol=TIGHT)


def test_matrix_to_quaternion_inverts_with_positive_scalar() -> None:
    q = random_quaternions(500, 4)
    back = attitude.matrix_to_quaternion(scipy_of(q).as_matrix())
    assert np.all(back[:, 0] >= 0)
    same_up_to_sign(back, q)


def test_rotate_agrees_with_scipy_at_any_norm() -> None:
    q, v = random_quaternions(200, 5), np.random.default_rng(6).normal(size=(200, 3))
    expected = scipy_of(q).apply(v)
    np.testing.assert_allclose(attitude.rotate(q, v), expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(attitude.rotate(0.1 * q, v), expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        attitude.rotate(attitude.quaternion_conjugate(q), expected), v, rtol=0, atol=1e-14
    )


@pytest.mark.parametrize(
    ("euler", "body_axis", "expected"),
    [
        # heading 90 degrees: y, which pointed north, points west
        ([0, 0, np.pi / 2], [0, 1, 0], [-1, 0, 0]),
        # pitch 90 degrees about x: y points up
        ([np.pi / 2, 0, 0], [0, 1, 0], [0, 0, 1]),
        # roll 90 degrees about y: x points down
        ([0, np.pi / 2, 0], [1, 0, 0], [0, 0, -1]),
    ],
)
def test_each_euler_angle_turns_the_documented_way(
    euler: list[float], body_axis: list[float], expected: list[float]
) -> None:
    np.testing.assert_allclose(
        attitude.euler_to_matrix(euler) @ body_axis, expected, rtol=0, atol=TIGHT
    )
    q = attitude.euler_to_quaternion(euler)
    np.testing.assert_allclose(attitude.rotate(q, body_axis), expected, rtol=0, atol=TIGHT)


@given(angle, angle, angle)
def test_euler_to_matrix_and_quaternion_agree_with_scipy(a: float, b: float, c: float) -> None:
    expected = scipy_of_euler(np.array([a, b, c]))
    np.testing.assert_allclose(
        attitude.euler_to_matrix([a, b, c]), expected.as_matrix(), rtol=0, atol=1e-14
    )
    same_up_to_sign(
        attitude.euler_to_quaternion([a, b, c]), expected.as_quat(scalar_first=True), 1e-14
    )


def test_quaternion_to_euler_agrees_with_scipy() -> None:
    euler = random_euler(500, 8)
    # the error of an angle grows as 1/cos(pitch)
    room = 1e-14 / np.cos(euler[:, :1])
    from_q = attitude.quaternion_to_euler(scipy_of_euler(euler).as_quat(scalar_first=True))
    from_c = attitude.matrix_to_euler(scipy_of_euler(euler).as_matrix())
    assert np.all(np.abs(from_q - euler) < room)
    assert np.all(np.abs(from_c - euler) < room)


@pytest.mark.parametrize("theta", [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-12, 1e-8, 1e-4])
def test_angles_give_the_attitude_back_at_the_pole(theta: float, off: float) -> None:
    gamma, psi = np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-3, 3, 7))
    euler = np.stack([np.full(gamma.shape, theta - np.sign(theta) * off), gamma, psi], axis=-1)
    c_nb = attitude.euler_to_matrix(euler)
    back = attitude.matrix_to_euler(c_nb)
    assert np.all(np.abs(back[..., 0]) <= np.nextafter(np.pi / 2, 2.0))
    np.testing.assert_allclose(attitude.euler_to_matrix(back), c_nb, rtol=0, atol=TIGHT)


def test_rotation_vector_agrees_with_scipy() -> None:
    rng = np.random.default_rng(9)
    direction = rng.normal(size=(300, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    phi = direction * np.concatenate([np.logspace(-12, 0, 200), np.linspace(1, 3.14, 100)])[:, None]
    q = attitude.rotation_vector_to_quaternion(phi)
    expected = Rotation.from_rotvec(phi).as_quat(scalar_first=True)
    np.testing.assert_allclose(q, expected, rtol=4e-16, atol=3e-16)
    back = attitude.quaternion_to_rotation_vector(q)
    assert np.all(np.linalg.norm(back - phi, axis=1) <= 2e-15 * np.linalg.norm(phi, axis=1) + 1e-30)
    same_turn = attitude.quaternion_to_rotation_vector(-5 * q)
    np.testing.assert_allclose(same_turn, phi, rtol=1e-12, atol=1e-28)
