"""The common front of the filters: units, sensors' values, fields."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude import estimator
from boresight.model.attitude.front import (
    ACC_COUNTS,
    ACC_LIMIT,
    FIELD_LIMIT,
    GYRO_COUNTS,
    GYRO_LIMIT,
    SENSED,
    CalibrateField,
    CalibrateInertial,
    CompassField,
    full_scale_params,
)
from boresight.model.attitude.mekf import Mekf
from tests.support.compiled_float import compiled_float, numpy_float

# -- calibration of gyro and accelerometer: against plain matrices, time steps, limits ------------

HALF = 2.0**31
#: Roundings: of the three matrix elements times full scale, of the bias, of the result.
GYRO_BOUND = 3 * 32768 * 2.0**-40 + 2.0**-32 + 2.0**-25
ACC_BOUND = 3 * 32768 * 2.0**-36 + 2.0**-28 + 2.0**-23


def records(counts, cycles, restart=None):
    """Counts (n, 6) and stamps in clock cycles as input records."""
    stamp = (np.asarray(cycles) + 2**31) % 2**32 / HALF - 1.0
    flag = np.zeros(len(counts)) if restart is None else np.asarray(restart)
    return np.column_stack([counts, stamp, flag])


def matrix(params, name):
    return np.array([[params[f"{name}_{r}{c}"] for c in "xyz"] for r in "xyz"])


def vector(params, name):
    return np.array([params[f"{name}_{a}"] for a in "xyz"])


def triple(out, letter):
    return np.stack([out[f"{letter}{a}"] for a in "xyz"], axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_matrices_and_biases(seed: int, draw, both) -> None:
    e = CalibrateInertial()
    params = draw(e, seed)
    counts = np.random.default_rng(seed).integers(-32768, 32768, (60, 6)).astype(float)
    counts[0], counts[1] = -32768, 32767
    fl, fixed, _ = both(e, records(counts, 97656 * np.arange(60)), params)
    g = counts[:, :3] @ matrix(params, "gyro").T - vector(params, "gyro_bias")
    a = counts[:, 3:] @ matrix(params, "acc").T - vector(params, "acc_bias")
    g, a = np.clip(g, -GYRO_LIMIT, GYRO_LIMIT), np.clip(a, -ACC_LIMIT, ACC_LIMIT)
    assert np.abs(triple(fl, "g") - g).max() < 1e-9
    assert np.abs(triple(fl, "a") - a).max() < 1e-9
    assert np.abs(triple(fixed, "g") - g).max() < GYRO_BOUND
    assert np.abs(triple(fixed, "a") - a).max() < ACC_BOUND


def test_mounting_that_swaps_axes(both) -> None:
    swap = {"gyro_xx": 0.0, "gyro_yy": 0.0, "gyro_xy": 1e-3, "gyro_yx": -1e-3}
    _, fixed, _ = both(CalibrateInertial(), records([[1000, 500, 0, 0, 0, 0]], [0]), swap)
    assert np.abs(triple(fixed, "g")[0] - [0.5, -1.0, 0.0]).max() < 1e-6


def test_time_steps_over_the_stamp_s_wrap(both) -> None:
    steps = np.array([1, 97656, 97657, 1_000_000, 10_000_000, 24_000_000, 3, 97656])
    stamps = 2**32 - 200_000 + np.cumsum(steps)
    fl, fixed, saturated = both(CalibrateInertial(), records(np.zeros((8, 6)), stamps))
    for out in (fl, fixed):
        assert np.abs(out["dt"][1:] - steps[1:] * 1e-8).max() < 1e-8
    assert not saturated


@pytest.mark.parametrize(
    "step, dt",
    [
        (24_980_000, 0.2498),
        (25_000_000, -0.0001),
        (35_000_000, -0.1001),
        (48_900_000, -0.2391),
        (49_100_000, -0.24),
        (2**31 - 1, -0.24),
        (2**31, -0.24),
        (2**32 - 1, -0.24),
    ],
)
def test_a_gap_is_told_by_a_step_below_zero(step: int, dt: float, both) -> None:
    fl, fixed, saturated = both(CalibrateInertial(), records(np.zeros((2, 6)), [5, 5 + step]))
    for out in (fl, fixed):
        assert out["dt"][1] == pytest.approx(dt, abs=1e-8)
    assert not saturated


def test_restart_says_so_and_keeps_the_stamp(both) -> None:
    x = records(np.zeros((3, 6)), [0, 1000, 98656], [-1.0, -1.0, 0.0])
    for out in both(CalibrateInertial(), x)[:2]:
        assert out["dt"].tolist()[:2] == [-0.25, -0.25]
        assert abs(out["dt"][2] - 97656e-8) < 1e-9


def test_wild_parameters_clamp_without_a_flag(draw, both) -> None:
    wild = {f"gyro_{a}{a}": 3.9e-3 for a in "xyz"} | {f"acc_{a}{a}": -0.0624 for a in "xyz"}
    counts = [[32767] * 6, [-32768] * 6]
    _, fixed, saturated = both(CalibrateInertial(), records(counts, [0, 1]), wild)
    top = np.array([64.0 - 2.0**-25, -64.0])[:, None]
    assert (triple(fixed, "g") == top).all()
    assert (triple(fixed, "a") == [[-256.0], [256.0 - 2.0**-23]]).all()
    assert not saturated


# -- A compass's heading as a field: against plain rotations, and what the filters make of it -----

COMPASS_FIELD_FILTERS = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")


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


@pytest.mark.parametrize("name", COMPASS_FIELD_FILTERS)
def test_every_filter_takes_the_compass_s_heading_at_any_tilt(name: str) -> None:
    e, tenths = estimator(name), attitudes(40, 2)
    truth = rotation(tenths)
    run = numpy_float(CompassField(), tenths.T[None].astype(float))
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


# -- calibration of a magnetometer: against a plain matrix, limits --------------------------------

#: Roundings: three matrix elements times the span of the counts, the bias, the result.
BOUND = 3 * 65536 * 2.0**-33 + 3 * 2.0**-16 * 0.5 + 2.0**-23


@pytest.mark.parametrize("seed", range(4))
def test_hard_and_soft_iron(seed: int, draw, both) -> None:
    e = CalibrateField()
    params = draw(e, seed, 0.05)
    counts = np.random.default_rng(seed).integers(-32768, 32768, (60, 3)).astype(float)
    counts[0], counts[1] = -32768, 32767
    fl, fixed, _ = both(e, counts, params)
    m = np.array([[params[f"field_{r}{c}"] for c in "xyz"] for r in "xyz"])
    b = np.array([params[f"field_bias_{a}"] for a in "xyz"])
    wanted = np.clip((counts - b) @ m.T, -FIELD_LIMIT, FIELD_LIMIT)
    for out, bound in ((fl, 1e-9), (fixed, BOUND)):
        assert np.abs(np.stack([out[f"m{a}"] for a in "xyz"], axis=1) - wanted).max() < bound


# -- what sensors give: names, units, and the makers' full scales ---------------------------------


def test_full_scales() -> None:
    """ADIS16385: 300 deg/s and 5 g; HMR3300: 2 gauss."""
    assert SENSED["gy"].high == pytest.approx(math.radians(300.0), rel=1e-6)
    assert SENSED["az"].high == pytest.approx(5.0 * 9.80665, rel=1e-6)
    assert SENSED["mx"].high == 200.0
    assert (GYRO_COUNTS, ACC_COUNTS) == (24000, 20000)
    for name, sensed in SENSED.items():
        assert sensed.low == -sensed.high or name == "dt"
    assert SENSED["dt"].low < 0.0 < SENSED["dt"].high


def test_parameters_that_stand_for_a_full_scale() -> None:
    result = full_scale_params(Mekf.params, rate=10.0, force=49.0)
    assert result == {
        "gyro_most_sq": pytest.approx(9.8**2),
        "force_most_sq": pytest.approx((0.98 * 49.0 - 9.80665) ** 2),
    }
    assert list(full_scale_params(Mekf.params, force=49.0)) == ["force_most_sq"]
    assert full_scale_params((), rate=10.0) == {}
    limits = {q.name: (q.low, q.high) for q in Mekf.params}
    assert full_scale_params(Mekf.params, rate=100.0)["gyro_most_sq"] == limits["gyro_most_sq"][1]
    assert full_scale_params(Mekf.params, rate=0.1)["gyro_most_sq"] == limits["gyro_most_sq"][0]
