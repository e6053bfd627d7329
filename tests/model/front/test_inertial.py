"""Calibration of gyro and accelerometer: against plain matrices, time steps, limits."""

import numpy as np
import pytest

from boresight.model.estimator import param_words
from boresight.model.estimators import FILTERS, estimator
from boresight.model.front.inertial import (
    ACC_LIMIT,
    ACC_SCALE,
    GAP_S,
    GYRO_LIMIT,
    CalibrateInertial,
)

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


def test_defaults_are_the_sensors_scales(both) -> None:
    counts = [[24000, 0, 0, 0, 0, 4000], [0, -80, 0, 20000, 0, 0], [0, 0, 1, 0, -1, 0]]
    _, fixed, saturated = both(CalibrateInertial(), records(counts, [0, 1, 2]))
    g, a = np.degrees(triple(fixed, "g")), triple(fixed, "a") / 9.80665
    assert np.abs(g - [[300, 0, 0], [0, -1, 0], [0, 0, 0.0125]]).max() < 1e-5
    assert np.abs(a - [[0, 0, 1], [5, 0, 0], [0, -0.25e-3, 0]]).max() < 1e-6
    assert not saturated


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


@pytest.mark.parametrize("tick_s", [1e-9, 2e-8, 9e-7])
def test_any_clock(tick_s: float, both) -> None:
    longest = int(GAP_S / tick_s * 0.999)
    x = records(np.zeros((3, 6)), np.cumsum([0, 1000, min(longest, 2**32 - 1)]))
    for out in both(CalibrateInertial(), x, {"tick_s": tick_s})[:2]:
        wanted = np.array([1000, min(longest, 2**32 - 1)]) * tick_s
        assert (np.abs(out["dt"][1:] - wanted) < 2.0**-33 + 3e-7 * wanted).all()


def test_wild_parameters_clamp_without_a_flag(draw, both) -> None:
    wild = {f"gyro_{a}{a}": 3.9e-3 for a in "xyz"} | {f"acc_{a}{a}": -0.0624 for a in "xyz"}
    counts = [[32767] * 6, [-32768] * 6]
    _, fixed, saturated = both(CalibrateInertial(), records(counts, [0, 1]), wild)
    top = np.array([64.0 - 2.0**-25, -64.0])[:, None]
    assert (triple(fixed, "g") == top).all()
    assert (triple(fixed, "a") == [[-256.0], [256.0 - 2.0**-23]]).all()
    assert not saturated


@pytest.mark.parametrize("word", [26, 28, 32])
@pytest.mark.parametrize("name", FILTERS)
def test_formats_are_those_of_the_filters_inputs(word: int, name: str) -> None:
    front, program = CalibrateInertial().compile(word=word), estimator(name).compile(word=word)
    wanted = {program.values[n].name: program.format(n) for n in program.inputs}
    for out, n in zip(front.output_names, front.outputs, strict=True):
        assert front.format(n) == wanted[out]


def test_default_scale_is_kept_by_its_word() -> None:
    program = CalibrateInertial().compile()
    words = param_words(program, CalibrateInertial().param_values())
    number = program.find("acc_xx")
    assert abs(program.format(number).real(words[number]) / ACC_SCALE - 1) < 1e-8
