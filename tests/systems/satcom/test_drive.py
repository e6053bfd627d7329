"""The drives: what is specified, at any rate."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.systems.satcom.drive import DRIVES, SHADOW_DB, city_drive, drive, specification_drive

RATE_HZ = 50.0


@pytest.mark.parametrize("name, minutes", [("specification", 5), ("city", 30), ("rough", 5)])
def test_what_every_drive_is(name: str, minutes: int) -> None:
    d = drive(name)
    assert len(d.ride.q) == minutes * 60 * RATE_HZ == len(d.loss_db)
    beyond = (np.abs(d.ride.acceleration) > [0.3, 0.3, 0.5]).any(axis=1)
    assert (beyond == d.accelerated).all() and 0.1 < beyond.mean() < 0.6
    assert not d.accelerated[: int(15 * RATE_HZ)].any()  # it stands
    speed = np.cumsum(np.einsum("ij,ij->i", d.ride.acceleration[:, :2], heading(d.ride))) / RATE_HZ
    assert speed.min() > -0.5 and 14.0 < speed.max() < 20.0


def heading(d):
    return np.stack([np.cos(d.euler[:, 2]), np.sin(d.euler[:, 2])], axis=1)


def test_specification() -> None:
    d = specification_drive().ride
    turn = np.degrees(np.gradient(d.euler[:, 2])) * RATE_HZ
    for rate in (12.0, -8.0, 6.0):
        assert (np.abs(turn - rate) < 1e-6).mean() > 0.02
    along = np.einsum(
        "ij,ij->i", Rotation.from_quat(np.roll(d.q, -1, axis=1)).apply(d.force)[:, :2], heading(d)
    )
    for level in (2.0, -2.0, 1.5, -1.0, 1.0):
        assert (np.abs(along - level) < 1e-6).mean() * 300.0 > 3.0
    assert np.degrees(np.abs(d.euler[:, :2]).max(axis=0)) == pytest.approx([4.5, 4.0], abs=0.1)
    assert not specification_drive().loss_db.any()


def test_rough() -> None:
    d, calm = drive("rough").ride, specification_drive().ride
    assert np.degrees(d.euler[:, 0].mean()) == pytest.approx(12.0, abs=0.1)
    assert d.euler[:, 2] == pytest.approx(3.0 * calm.euler[:, 2])
    assert d.euler[:, 1] == pytest.approx(2.0 * calm.euler[:, 1])


@pytest.mark.parametrize("name", DRIVES)
def test_other_rates_are_the_same_drive(name: str) -> None:
    once, often = drive(name), drive(name, 200.0)
    assert often.ride.rate_hz == 200.0
    n = len(once.loss_db)
    far = np.degrees(np.abs(once.ride.euler - often.ride.euler[::4][:n]))
    assert far[:, :2].max() < 0.6 and far[:, 2].max() < 3.0 and far[:500].max() < 1e-9
    assert np.abs(once.loss_db - often.loss_db[::4]).mean() < 0.1


def test_city() -> None:
    whole = city_drive()
    d, shadow = whole.ride, whole.loss_db == SHADOW_DB
    edges = np.flatnonzero(np.diff(shadow.astype(int)))
    lengths = np.diff(edges)[::2] / RATE_HZ
    assert (lengths > 14.0).sum() == 4 and ((lengths > 0.3) & (lengths < 2.5)).sum() > 15
    turned = np.degrees(np.abs(np.gradient(d.euler[:, 2])) * RATE_HZ)
    assert turned.max() == pytest.approx(20.0, abs=0.1)
    vertical = d.acceleration[:, 2]
    assert 2.0 < np.abs(vertical).max() < 6.0  # speed bumps
    assert not (city_drive(seed=2).ride.rate[: len(d.rate)] == d.rate).all()


@pytest.mark.parametrize(
    "name, rate_hz, message",
    [
        ("rail", 50.0, "drive: wanted one of specification, rough, city, found 'rail'"),
        ("city", 0.0, "drive, rate_hz: wanted 10 to 1000 Hz, found 0.0"),
        ("city", float("nan"), "drive, rate_hz: wanted 10 to 1000 Hz, found nan"),
    ],
)
def test_mistakes(name: str, rate_hz: float, message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}"):
        drive(name, rate_hz)
