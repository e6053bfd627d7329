"""The drives: what is specified, and rates and forces against differences of the attitude."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.worlds.satcom_drive import (
    DRIVES,
    GRAVITY,
    RATE_HZ,
    SHADOW_DB,
    city_drive,
    drive,
    specification_drive,
)


@pytest.mark.parametrize("name, minutes", [("specification", 5), ("city", 30)])
def test_rates_and_forces_are_those_of_the_attitude(name: str, minutes: int) -> None:
    d = drive(name)
    assert len(d.q) == minutes * 60 * RATE_HZ
    r = Rotation.from_quat(np.roll(d.q, -1, axis=1))
    expected = Rotation.from_euler("ZYX", d.euler[:, ::-1])
    assert (r.inv() * expected).magnitude().max() < 1e-9
    turned = r[:-1] * Rotation.from_rotvec(d.rate[1:] / RATE_HZ)
    assert (turned.inv() * r[1:]).magnitude().max() < 1e-9
    acceleration = r.apply(d.force) + [0.0, 0.0, GRAVITY]
    assert np.abs(acceleration[: int(15 * RATE_HZ)]).max() < 1e-9  # it stands
    beyond = (np.abs(acceleration) > [0.3, 0.3, 0.5]).any(axis=1)
    assert (beyond == d.accelerated).all() and 0.1 < beyond.mean() < 0.6
    speed = np.cumsum(np.einsum("ij,ij->i", acceleration[:, :2], heading(d))) / RATE_HZ
    assert speed.min() > -0.5 and 14.0 < speed.max() < 20.0


def heading(d):
    return np.stack([np.cos(d.euler[:, 2]), np.sin(d.euler[:, 2])], axis=1)


def test_specification() -> None:
    d = specification_drive()
    turn = np.degrees(np.gradient(d.euler[:, 2])) * RATE_HZ
    for rate in (12.0, -8.0, 6.0):
        assert (np.abs(turn - rate) < 1e-6).mean() > 0.02
    along = np.einsum(
        "ij,ij->i", Rotation.from_quat(np.roll(d.q, -1, axis=1)).apply(d.force)[:, :2], heading(d)
    )
    for level in (2.0, -2.0, 1.5, -1.0, 1.0):
        assert (np.abs(along - level) < 1e-6).mean() * 300.0 > 3.0
    assert np.degrees(np.abs(d.euler[:, :2]).max(axis=0)) == pytest.approx([4.5, 4.0], abs=0.1)
    assert not d.loss_db.any()


def test_city() -> None:
    d = city_drive()
    shadow = d.loss_db == SHADOW_DB
    edges = np.flatnonzero(np.diff(shadow.astype(int)))
    lengths = np.diff(edges)[::2] / RATE_HZ
    assert (lengths > 14.0).sum() == 4 and ((lengths > 0.3) & (lengths < 2.5)).sum() > 15
    turned = np.degrees(np.abs(np.gradient(d.euler[:, 2])) * RATE_HZ)
    assert turned.max() == pytest.approx(20.0, abs=0.1)
    vertical = Rotation.from_quat(np.roll(d.q, -1, axis=1)).apply(d.force)[:, 2] + GRAVITY
    assert 2.0 < np.abs(vertical).max() < 6.0  # speed bumps
    assert not (city_drive(2).rate[: len(d.rate)] == d.rate).all()


def test_no_such_drive() -> None:
    with pytest.raises(
        InputError, match=r"^drive: wanted one of specification, city, found 'rail'"
    ):
        drive("rail")
    assert set(DRIVES) == {"specification", "city"}
