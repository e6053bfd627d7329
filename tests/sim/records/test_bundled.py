"""`sim.records.bundled`: the logs are there, and hold what their README says."""

from pathlib import Path

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_euler,
    quaternion_to_rotation_vector,
    rotate,
    rotation_vector_to_quaternion,
)
from boresight.sim.records.bundled import bundled, bundled_names, is_comparison
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis

pytestmark = pytest.mark.pythons


@pytest.fixture(scope="module")
def walk() -> NineAxis:
    return NineAxis.of(read_record(bundled("ximu_walk")))


def sent(log: NineAxis) -> np.ndarray:
    """Rows with an estimate of the device."""
    assert log.q is not None
    return np.flatnonzero(~np.isnan(log.q[:, 0]))


def rms_deg(vectors: np.ndarray) -> float:
    return float(np.degrees(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))))


def test_names_and_paths() -> None:
    assert bundled_names() == ("synthetic_60s", "ximu_walk")
    for name in bundled_names():
        assert bundled(name).name == f"{name}.csv"
        assert read_record(bundled(name)).name == name


def test_which_attitude_is_not_truth(tmp_path: Path) -> None:
    assert is_comparison(bundled("ximu_walk")) and not is_comparison(bundled("synthetic_60s"))
    assert not is_comparison(tmp_path / "ximu_walk.csv")  # another log of that name


def test_unknown_name_lists_the_known() -> None:
    message = r"^name must be one of the bundled logs \(synthetic_60s, ximu_walk\), not 'x'$"
    with pytest.raises(InputError, match=message):
        bundled("x")


@pytest.mark.parametrize("name", ["README.md", "LICENSE.scikit-kinematics.txt"])
def test_source_and_licence_lie_beside_the_logs(name: str) -> None:
    text = (bundled("ximu_walk").parent / name).read_text(encoding="utf-8")
    assert "Thomas Haslwanter" in text


def test_walk_has_the_documented_size_and_rate(walk: NineAxis) -> None:
    assert len(walk) == 12625
    np.testing.assert_array_equal(np.diff(walk.t), 1 / 256)
    assert int(walk.mag_new.sum()) == 8194
    np.testing.assert_array_equal(np.diff(sent(walk)), 2)


def test_walk_quaternions_turn_as_the_gyro_does(walk: NineAxis) -> None:
    assert walk.q is not None
    rows = sent(walk)
    steps = rotation_vector_to_quaternion(walk.gyr * walk.dt[:, None])
    by_gyro = quaternion_multiply(steps[rows[1:] - 1], steps[rows[1:]])

    def apart(q: np.ndarray) -> float:
        by_device = quaternion_multiply(quaternion_conjugate(q[:-1]), q[1:])
        return rms_deg(
            quaternion_to_rotation_vector(
                quaternion_multiply(quaternion_conjugate(by_device), by_gyro)
            )
        )

    assert rms_deg(quaternion_to_rotation_vector(by_gyro)) > 1.0
    assert apart(walk.q[rows]) < 0.15
    assert apart(quaternion_conjugate(walk.q[rows])) > 1.5


@pytest.mark.parametrize(("start", "end"), [(0.0, 2.4), (13.1, 15.2), (17.8, 19.4)])
def test_walk_has_gravity_up_and_field_north_at_rest(
    walk: NineAxis, start: float, end: float
) -> None:
    assert walk.q is not None
    rows = sent(walk)
    rows = rows[(walk.t[rows] >= start) & (walk.t[rows] <= end)]
    up = rotate(walk.q[rows], walk.acc[rows]).mean(axis=0)
    assert np.degrees(np.arctan2(np.hypot(*up[:2]), up[2])) < 1.0
    np.testing.assert_allclose(up[2], 9.80665, atol=0.15)
    rows = rows[walk.mag_new[rows]]
    east, north, vertical = rotate(walk.q[rows], walk.mag[rows]).mean(axis=0)
    assert abs(np.degrees(np.arctan2(east, north))) < 1.5
    assert 40 < np.degrees(np.arctan2(-vertical, north)) < 45


def test_walk_starts_at_the_filters_own_origin(walk: NineAxis) -> None:
    assert walk.q is not None
    # level, x to the north
    euler = np.degrees(quaternion_to_euler(walk.q[sent(walk)[0]]))
    np.testing.assert_allclose(euler, [0, 0, 90], atol=0.25)


def test_walk_has_the_documented_motion(walk: NineAxis) -> None:
    assert walk.q is not None
    pitch, roll, _ = np.degrees(quaternion_to_euler(walk.q[sent(walk)])).T
    np.testing.assert_allclose([pitch.min(), pitch.max()], [-49.1, 44.2], atol=0.05)
    np.testing.assert_allclose([roll.min(), roll.max()], [-180, 180], atol=1)
    np.testing.assert_allclose(np.degrees(np.linalg.norm(walk.gyr, axis=1)).max(), 633, atol=0.5)
