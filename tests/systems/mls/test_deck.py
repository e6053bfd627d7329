"""Decks and their sensors, against scipy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.systems.mls.deck import MOTIONS, SensorErrors, deck, records

EXACT = SensorErrors(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)


def attitude(what) -> Rotation:
    return Rotation.from_euler("ZYX", what.euler[:, ::-1])


@pytest.mark.parametrize("motion", MOTIONS)
def test_quaternions_are_those_of_the_angles(motion: str) -> None:
    what = deck(motion, 2.0, 3, 40.0)
    q = Rotation.from_quat(np.roll(what.q, -1, axis=1))
    assert (q.inv() * attitude(what)).magnitude().max() < 1e-12
    assert len(what.q) == 2000 == len(what.lift)
    other = deck(motion, 2.0, 4, 40.0)
    assert np.abs(what.euler - other.euler).max() > 1e-4
    assert abs(np.degrees(what.euler[:, 2]).mean() - 40.0) < 12.0


def test_the_table_jumps_by_eight_degrees_in_sixty_ms() -> None:
    euler = np.degrees(deck("table", 5.0, 1).euler)
    for k, at in enumerate((1500, 3000, 4500)):
        jump = euler[at + 60, k] - euler[at, k]
        assert jump == pytest.approx(8.0, abs=0.8), k
    assert not euler[0].any()


def test_the_ship_turns_by_ten_degrees() -> None:
    euler = np.degrees(deck("rolling", 20.0, 2).euler)
    assert np.abs(euler).max(axis=0) == pytest.approx([10.0] * 3, abs=0.1)


def test_exact_sensors() -> None:
    what = deck("sea_6", 1.0, 5, 130.0)
    u, r = records(what, 5, EXACT, dip_deg=30.0), attitude(what)
    assert u[0, 0] == -1e-3 and (u[1:, 0] == 1e-3).all()
    turns = (r[:-1].inv() * r[1:]).as_rotvec() * 1000.0
    assert u[1:, 1:4] == pytest.approx(turns, abs=1e-9)
    field = r.inv().apply(50.0 * np.array([np.cos(np.pi / 6), 0.0, -0.5]))
    assert u[:, 7:] == pytest.approx(field, abs=1e-9)
    force = r.inv().apply(np.stack([0.0 * what.lift, 0.0 * what.lift, 9.80665 + what.lift], 1))
    assert u[:, 4:7] == pytest.approx(force, abs=1e-9) and np.ptp(what.lift) > 1e-3


def test_errors_are_as_large_as_they_say() -> None:
    what = deck("sea_3", 5.0, 6)
    exact, rough = records(what, 6, EXACT), records(what, 6, SensorErrors())
    apart = rough - exact
    assert np.degrees(apart[:, 1:4]).std(axis=0) == pytest.approx([0.3] * 3, rel=0.05)
    assert np.degrees(apart[:, 1:4]).mean(axis=0) == pytest.approx(
        SensorErrors().gyro_bias, abs=0.02
    )
    assert apart[:, 7:].std() == pytest.approx(1.0, rel=0.05)
    assert apart[:, 4:7].std() == pytest.approx(0.196, rel=0.05)
    late = records(what, 6, SensorErrors(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 5))
    assert (late[5:, 1:4] == exact[:-5, 1:4]).all() and (late[:, 4:] == exact[:, 4:]).all()
    drawn = [records(what, s, SensorErrors(0.0, (0.0, 0.0, 0.0), 0.2))[0, 1:4] for s in range(40)]
    assert np.degrees(drawn).std() == pytest.approx(0.2, rel=0.3)


def test_no_such_motion() -> None:
    with pytest.raises(InputError, match=r"^motion: wanted one of table, rolling, sea_3"):
        deck("sea_9", 1.0, 1)
