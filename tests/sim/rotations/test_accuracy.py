"""Attitude errors, outputs and angles."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.accuracy.figures import attitude_errors
from boresight.sim.rotations.accuracy import attitude_error
from boresight.sim.rotations.rotation import (
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
)
from boresight.sim.rotations.zyx import angles_of, quaternions_of, wrapped

# -- `sim.rotations.accuracy` against closed forms of its three angles -----------------------------


def turn(axis: list[float], degrees: float) -> np.ndarray:
    unit = np.array(axis) / np.linalg.norm(axis)
    return rotation_vector_to_quaternion(np.radians(degrees) * unit)


def references(count: int = 20) -> np.ndarray:
    return np.random.default_rng(2).normal(size=(count, 4))


@pytest.mark.parametrize("degrees", [1e-7, 0.5, 30.0, 170.0])
@pytest.mark.parametrize(
    ("axis", "split"), [([0, 0, 1], (1, 1, 0)), ([1, 0, 0], (1, 0, 1)), ([3, -4, 0], (1, 0, 1))]
)
def test_turn_about_the_vertical_is_heading_and_any_level_axis_is_inclination(
    axis: list[float], split: tuple[int, int, int], degrees: float
) -> None:
    q_ref = references()
    # a turn in navigation axes stands on the left
    for sense in (1.0, -1.0):
        errors = attitude_error(quaternion_multiply(turn(axis, sense * degrees), q_ref), q_ref)
        for entry, share in zip(errors, split, strict=True):
            np.testing.assert_allclose(entry, degrees * share, rtol=1e-9, atol=2e-12)


@pytest.mark.parametrize("norm", [1e-90, 0.3, -3.0, 1e90])
def test_norms_and_signs_do_not_count(norm: float) -> None:
    q_ref, q_est = references(), references()[::-1]
    one = [q / np.linalg.norm(q, axis=1, keepdims=True) for q in (q_est, q_ref)]
    for wanted, entry in zip(
        attitude_error(*one), attitude_error(norm * one[0], abs(norm) * one[1]), strict=True
    ):
        np.testing.assert_allclose(entry, wanted, rtol=1e-12, atol=1e-12)
    q_est[3] = 0.0
    with pytest.raises(InputError, match="q must have a norm above zero"):
        attitude_error(q_est, q_ref)


def test_mixed_error_has_the_published_form() -> None:
    q_ref = references()
    error = quaternion_multiply(turn([0, 0, 1], 50.0), turn([0.6, 0.8, 0], 20.0))
    result = attitude_error(quaternion_multiply(error, q_ref), q_ref)
    # heading and inclination of such a product are its two factors; total: w = cos 25 cos 10
    np.testing.assert_allclose(result.heading, 50.0, rtol=1e-12)
    np.testing.assert_allclose(result.inclination, 20.0, rtol=1e-12)
    cosine = np.cos(np.radians(25)) * np.cos(np.radians(10))
    np.testing.assert_allclose(result.total, np.degrees(2 * np.arccos(cosine)), rtol=1e-12)


def test_inclination_is_the_angle_between_the_verticals() -> None:
    p, q = references(50), np.random.default_rng(3).normal(size=(50, 4))
    # the vertical of n, carried from n to b by one attitude and back by the other
    back = rotate(p, rotate(q * [1, -1, -1, -1], [0.0, 0.0, 1.0]))
    np.testing.assert_allclose(
        attitude_error(p, q).inclination, np.degrees(np.arccos(back[:, 2])), rtol=1e-9
    )


def test_the_figure_is_the_root_of_the_mean_square() -> None:
    q_ref = references(2)
    q_est = np.stack(
        [
            quaternion_multiply(turn([0, 0, 1], 3.0), q_ref[0]),
            quaternion_multiply(turn([1, 0, 0], 4.0), q_ref[1]),
        ]
    )
    result = attitude_errors(q_est, q_ref, np.ones(2, dtype=bool))
    expected = (np.sqrt(12.5), 3 / np.sqrt(2), 4 / np.sqrt(2))
    np.testing.assert_allclose([*result.values()], expected, rtol=1e-9)


def test_only_moving_samples_with_a_reference_count() -> None:
    q_ref = references(4)
    q_est = np.stack(
        [quaternion_multiply(turn([0, 0, 1], 10.0 * (k + 1)), q_ref[k]) for k in range(4)]
    )
    q_ref[2] = np.nan
    for mov, square in (
        ([0, 1, 1, 1], (20**2 + 40**2) / 2),
        ([1] * 4, (10**2 + 20**2 + 40**2) / 3),
    ):
        error = attitude_errors(q_est, q_ref, np.array(mov, dtype=bool))
        np.testing.assert_allclose(error["heading"], np.sqrt(square))
    with pytest.raises(InputError, match=r"^no sample counts: .*$"):
        attitude_errors(q_est, q_ref, np.zeros(4, dtype=bool))
    q_est[1] = np.nan  # an estimate that is none spoils the figure
    assert np.isnan([*attitude_errors(q_est, q_ref, np.ones(4, dtype=bool)).values()]).all()


# -- roll, pitch and heading against scipy's sequence ZYX -----------------------------------------

EULER = np.random.default_rng(1).uniform(-1.0, 1.0, (4, 50, 3)) * [3.1, 1.55, 3.1]


def test_quaternions() -> None:
    result = np.roll(quaternions_of(EULER), -1, axis=-1).reshape(-1, 4)
    wanted = Rotation.from_euler("ZYX", EULER[..., ::-1].reshape(-1, 3))
    assert (Rotation.from_quat(result).inv() * wanted).magnitude().max() < 1e-12


def test_angles_and_back() -> None:
    assert angles_of(quaternions_of(EULER)) == pytest.approx(EULER, abs=1e-9)
    up = angles_of(np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5) * (1.0 + 1e-9), 0.0]))
    assert up[1] == pytest.approx(np.pi / 2.0)  # rounding beyond one is no fault


def test_wrapped() -> None:
    assert wrapped([190.0, -190.0, 180.0, 0.25], 360.0).tolist() == [-170.0, 170.0, -180.0, 0.25]
    assert wrapped(np.array([1.3]), 2.0) == pytest.approx([-0.7])
