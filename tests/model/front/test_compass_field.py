"""A compass's heading as a field: against plain rotations, and what the filters make of it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.estimators import estimator
from boresight.model.front.compass_field import CompassField
from tests.support.compiled_float import compiled_float

FILTERS = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")


def attitudes(n: int, seed: int = 0):
    """Tenths of degrees of heading, pitch and roll (n, 3), any heading, tilts up to 60 deg."""
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.integers(0, 3600, n), rng.integers(-600, 601, (n, 2))])


def field_of(out):
    return np.stack([out[f"m{a}"] for a in "xyz"], axis=1)


def rotation(tenths):
    """C_nb of compass angles: heading clockwise, intrinsic z-x'-y''."""
    heading, pitch, roll = np.radians(np.asarray(tenths, dtype=float) / 10).T
    return Rotation.from_euler("ZXY", np.stack([-heading, pitch, roll], axis=1))


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"vertical_ut": 44.0, "horizontal_ut": 18.0},
        {"heading_offset_ht": 0.25, "pitch_offset_ht": -0.01, "roll_offset_ht": 0.02},
    ],
)
def test_against_plain_rotations(params, both) -> None:
    x = attitudes(200)
    fl, fixed, saturated = both(CompassField(), x, params)
    shift = [
        -params.get("heading_offset_ht", 0.0),
        params.get("pitch_offset_ht", 0.0),
        params.get("roll_offset_ht", 0.0),
    ]
    level = [0.0, params.get("horizontal_ut", 30.0), -params.get("vertical_ut", 0.0)]
    wanted = rotation(x + 1800 * np.array(shift)).inv().apply(level)
    assert np.abs(field_of(fl) - wanted).max() < 1e-9
    assert np.abs(field_of(fixed) - wanted).max() < 2e-5  # uT
    assert not saturated


def test_signs_and_mounting(both) -> None:
    """A compass that counts the other way round and stands turned by 90 deg about z."""
    x = attitudes(50, 1)
    flipped = x * [1, -1, -1]
    flipped[:, 0] = -x[:, 0]
    params = {
        "heading_scale": 1 / 1800,
        "pitch_scale": -1 / 1800,
        "roll_scale": -1 / 1800,
        "mount_xx": 0.0,
        "mount_yy": 0.0,
        "mount_xy": 1.0,
        "mount_yx": -1.0,
    }
    _, fixed, _ = both(CompassField(), flipped, params)
    plain = rotation(x).inv().apply([0.0, 30.0, 0.0])
    assert np.abs(field_of(fixed) - plain[:, [1, 0, 2]] * [1, -1, 1]).max() < 2e-5


@pytest.mark.parametrize("name", FILTERS)
def test_every_filter_takes_the_compass_s_heading_at_any_tilt(name: str) -> None:
    e, tenths = estimator(name), attitudes(40, 2)
    truth = rotation(tenths)
    run = CompassField().run_float(tenths.T[None].astype(float)).outputs
    field = field_of({k: v[0] for k, v in run.items()})
    force = truth.inv().apply([0.0, 0.0, 9.80665])
    row = np.column_stack([np.full(40, 0.02), np.zeros((40, 3)), field, force]).T
    out = compiled_float(e, np.broadcast_to(row, (1000, *row.shape)))[0]
    for key, wanted in (
        ("heading", -tenths[:, 0] / 1800),
        ("pitch", tenths[:, 1] / 1800),
        ("roll", tenths[:, 2] / 1800),
    ):
        off = (out[key][-1] - wanted + 1) % 2 - 1
        assert np.abs(off).max() * 180 < 0.1, key
