"""The complementary filter: convergence, alignment, bad input, the vertical, the printed eq. (3).

Float runs check the mathematics; fixed-point runs check that the program does the same.
"""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude.complementary import Complementary
from boresight.model.estimator import input_words
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import euler_to_quaternion
from tests.support import exact_sensors
from tests.support.exact_sensors import (
    ACC,
    DT,
    GRAVITY,
    GYR,
    MAG,
    apart,
    at_rest,
    bits,
    degrees,
    real,
)

FILTER = Complementary()
FIELD = np.array([0.0, 27.9, -46.2])
QUICK = {"kp_pitch_per_s": 4.0, "kp_roll_per_s": 4.0, "kp_heading_per_s": 4.0}
GYRO_ONLY = {
    name: 0.0
    for name in (
        "kp_pitch_per_s",
        "kp_roll_per_s",
        "kp_heading_per_s",
        "ki_pitch_per_s2",
        "ki_roll_per_s2",
        "ki_heading_per_s2",
    )
}
CLOSED = {"acc_min_sq": (0.5 * GRAVITY) ** 2, "acc_max_sq": (2.0 * GRAVITY) ** 2}
records = partial(exact_sensors.records, field=FIELD)


def static(q: Any, steps: int, dt: float = 0.05, field: Any = FIELD) -> Any:
    return at_rest(q, steps, dt, field)


def run_float(x: Any, params: Any = None) -> Any:
    return exact_sensors.run_float(FILTER, x, params)


def machine(runs: int, params: Any = None, word: int = 32) -> Any:
    return exact_sensors.machine(FILTER, runs, params, word)


def run_fixed(x: Any, params: Any = None) -> Any:
    return exact_sensors.run_fixed(FILTER, x, params)


RUNS = {"float": run_float, "fixed": run_fixed}
both = pytest.mark.parametrize("run", RUNS.values(), ids=RUNS.keys())


def wrapped_deg(half_turns: Any) -> Any:
    return ((half_turns + 1.0) % 2.0 - 1.0) * 180.0


def at_rest_first(q: Any, samples: int = 5) -> Any:
    """Attitudes (steps, ..., 4) that begin with some samples at rest, for the alignment."""
    return np.concatenate([np.repeat(q[:1], samples, axis=0), q])


# -- (a) at rest ----------------------------------------------------------------------------------


def test_pitch_roll_and_heading_are_the_documented_angles() -> None:
    euler = np.array([20.0, -50.0, 130.0])
    for run in RUNS.values():
        out = run(static(degrees(*euler)[None], 5))
        results = [out[name][-1, 0] * 180.0 for name in ("pitch", "roll", "heading")]
        assert np.abs(results - euler).max() < 1e-4


def test_declination_east_turns_the_heading_clockwise() -> None:
    """With magnetic north 10 deg east of true north the heading still counts from true north."""
    field = 27.9 * np.array([math.sin(math.radians(10)), math.cos(math.radians(10)), -1.6])
    q = degrees(5.0, -20.0, 30.0)[None]
    for run in RUNS.values():
        out = run(static(q, 40, field=field), {"declination_ht": 10 / 180})
        assert apart(out, q)[2:].max() < 1e-4


CHANNELS = (
    ("kp_pitch_per_s", (6.0, 0.0, 0.0), "pitch"),
    ("kp_roll_per_s", (0.0, 6.0, 0.0), "roll"),
    ("kp_heading_per_s", (0.0, 0.0, 6.0), "heading"),
)


@both
@pytest.mark.parametrize(("gain", "jump", "channel"), CHANNELS, ids=[c[2] for c in CHANNELS])
def test_each_channel_decays_with_its_own_gain(
    run: Any, gain: str, jump: Any, channel: str
) -> None:
    """A jump of 6 deg that the gyro did not see fades as exp(-kp t), in its channel alone."""
    q = np.concatenate(
        [np.repeat(degrees(0, 0, 0)[None], 3, 0), np.repeat(degrees(*jump)[None], 41, 0)]
    )[:, None]
    x = records(q, 0.05)
    x[:, GYR] = 0.0
    kp = 0.8
    out = run(x, GYRO_ONLY | {gain: kp})
    remaining = 6.0 - 180.0 * out[channel][:, 0]
    assert abs(remaining[2] - 6.0) < 0.01
    decay = remaining[43] / remaining[3]
    assert decay == pytest.approx(math.exp(-kp * 40 * 0.05), rel=0.05)
    for other in {"pitch", "roll", "heading"} - {channel}:
        assert np.abs(out[other] * 180.0).max() < 0.01


BIASES = (("ki_pitch_per_s2", 0), ("ki_roll_per_s2", 1), ("ki_heading_per_s2", 2))


@pytest.mark.parametrize(("gain", "axis"), BIASES, ids=["x", "y", "z"])
def test_a_constant_bias_is_learnt(gain: str, axis: int) -> None:
    """By its own integral: without it the error stays at bias (1/kp - dt)."""
    bias = 0.01 * (-1) ** axis
    x = static(degrees(0, 0, 0)[None], 400)
    x[:, 1 + axis] += bias
    kp = {name: 1.0 for name in QUICK}
    without = run_float(x, GYRO_ONLY | kp)
    with_it = run_float(x, GYRO_ONLY | kp | {gain: 0.25})
    channel = ("pitch", "roll", "heading")[axis]
    assert without[channel][-1, 0] * math.pi == pytest.approx(0.95 * bias, rel=0.01)
    assert abs(with_it[channel][-1, 0] * math.pi) < 0.02 * abs(bias)
    m = machine(1, GYRO_ONLY | kp | {gain: 0.25})
    m.run(input_words(m.program, x))
    results = [
        float(m.program.format(n).real(m.values[n][0]))
        for n in (m.program.find(f"bias_{a}") for a in "xyz")
    ]
    want = np.zeros(3)
    want[axis] = bias
    assert np.abs(results - want).max() < 0.01 * abs(bias)


def test_the_learnt_bias_belongs_to_the_body() -> None:
    """Learnt level, it still holds after the body has been turned on its side."""
    bias = np.array([0.01, -0.008, 0.006])
    steps = 1200
    level, side = np.zeros((steps, 3)), np.zeros((100, 3))
    side[:, 1] = np.radians(70.0) * np.minimum(np.arange(1, 101) / 40, 1.0)
    side[:, 0] = np.radians(-50.0) * np.minimum(np.arange(1, 101) / 40, 1.0)
    q = euler_to_quaternion(np.concatenate([level, side]))[:, None]
    x = records(q, 0.05)
    x[:, GYR, 0] += bias
    gains = {name: 1.0 for name in QUICK} | {
        "ki_pitch_per_s2": 0.25,
        "ki_roll_per_s2": 0.25,
        "ki_heading_per_s2": 0.25,
    }
    out = run_float(x, GYRO_ONLY | gains)
    assert apart(out, q)[steps - 1, 0] < 1e-3
    assert apart(out, q)[steps:].max() < 0.1


# -- (b) alignment and status ---------------------------------------------------------------------


@both
def test_a_missing_sample_is_never_used_however_wide_the_gate(run: Any) -> None:
    q = degrees(-20.0, 40.0, 75.0)[None]
    x = static(q, 12)
    x[5:, MAG] = 0.0
    assert apart(run(x, QUICK | {"mag_gate": 3.9}), q)[2:].max() < 1e-4


@both
def test_without_a_magnetometer_for_ever_the_gyro_keeps_the_heading(run: Any) -> None:
    euler = np.zeros((200, 3))
    euler[:, 2] = 0.6 * np.arange(200) * 0.05
    euler[:, 0] = 0.3
    x = records(at_rest_first(euler_to_quaternion(euler)[:, None]), 0.05)
    x[:, MAG] = 0.0
    out = run(x)
    assert set(bits(out)[2:, 0]) == {0b1010}
    assert np.abs(wrapped_deg(out["heading"][5:, 0] - euler[:, 2] / math.pi)).max() < 1e-2
    assert np.abs(out["pitch"][5:, 0] * math.pi - 0.3).max() < 1e-5


@both
def test_a_disturbed_field_is_not_used_until_it_lasts(run: Any) -> None:
    """Twice the field from elsewhere: bit 4, heading kept; a lasting one becomes the mean."""
    q = degrees(10.0, -15.0, 40.0)[None]
    x = static(q, 120)
    x[5:8, MAG] = 2.0 * x[5:8, MAG][:, [1, 2, 0]]
    x[20:, MAG] *= 2.0
    out = run(x, {"mag_rate_per_s": 1.0})
    status = bits(out)[:, 0]
    assert status[5:8].tolist() == [0b10000] * 3
    assert not status[2:5].any() and not status[8:20].any()
    assert apart(out, q)[2:].max() < 1e-4
    assert status[20] == 0b10000 and status[-1] == 0
    # the mean 4 - 3 exp(-t) of the squared field takes that long to come within 0.4 of 4
    used_again = 0.05 * np.flatnonzero(status[20:])[-1]
    assert used_again == pytest.approx(math.log(3 / (4 - 4 / 1.4)), abs=0.15)


@both
def test_accelerometer_gate(run: Any) -> None:
    """Closed at 0.5 g and 2 g: a saturated accelerometer is left out, bit 2; open it is used."""
    q = degrees(0.0, 0.0, 0.0)[None]
    x = static(q, 12)
    x[5:8, ACC] = np.array([160.0, 0.0, 160.0])[:, None]
    x[9, ACC] = 0.4 * x[9, ACC]
    x[10, ACC] = 2.1 * x[10, ACC]
    x[11, ACC] = 1.9 * x[11, ACC]
    out = run(x, CLOSED)
    assert bits(out)[:, 0].tolist() == [3, 3, 0, 0, 0, 4, 4, 4, 0, 4, 4, 0]
    assert apart(out, q)[2:].max() < 1e-4
    used = run(x)
    assert bits(used)[5, 0] == 0
    assert abs(used["roll"][7, 0]) * 180 > 10.0


@both
def test_gyro_saturation_is_flagged(run: Any) -> None:
    x = static(degrees(0, 0, 0)[None], 6, dt=0.01)
    x[3, 2] = 34.3
    x[4, 2] = 34.4
    x[5, 1:4] = np.array([20.0, 20.0, -20.0])[:, None]
    assert bits(run(x))[2:, 0].tolist() == [0, 0, 0b100000, 0b100000]


# -- (c) bad input --------------------------------------------------------------------------------


@both
def test_a_negative_time_step_restarts(run: Any) -> None:
    """Alignment anew, whatever was before; the learnt bias is kept."""
    q = degrees(30.0, 60.0, -100.0)[None]
    x = np.concatenate([static(degrees(-70.0, -170.0, 20.0)[None], 6), static(q, 5)])
    x[6, DT] = -0.01
    out = run(x)
    assert bits(out)[:, 0].tolist() == [3, 3, 0, 0, 0, 0, 3, 3, 0, 0, 0]
    assert apart(out, q)[8:].max() < 1e-4


def garbage(rng: Any, arith: Any, runs: int, steps: int) -> Any:
    """Words of every kind: uniform, small, extreme, with and without restarts."""
    words = rng.integers(arith.min_int, arith.max_int + 1, (steps, 10, runs))
    words >>= rng.integers(0, arith.word - 2, (1, 10, runs)) * (np.arange(runs) >= runs // 3)
    extreme = rng.choice([arith.min_int, arith.max_int, 0, -1], (steps, 10, runs))
    words = np.where(np.arange(runs) % 4 == 1, extreme, words)
    words[steps // 2 :, :, ::8] = extreme[0, :, ::8]  # stuck
    forward = np.arange(runs) % 3 > 0
    words[:, 0] = np.where(forward & (words[:, 0] < 0), ~words[:, 0], words[:, 0])
    return words


@pytest.mark.parametrize("word", [32, 24])
def test_garbage_is_survived_and_forgotten(word: int) -> None:
    """1000 samples of anything, then 60 s of truth: no NaN, unit norm, attitude found again."""
    runs = 64
    rng = np.random.default_rng(word)
    p = FILTER.compile(word=word)
    words = garbage(rng, p.arithmetic, runs, 1000 if word == 32 else 300)
    q = degrees(rng.uniform(-60, 60, runs), *rng.uniform(-180, 180, (2, runs)))
    rest = static(q, 600, dt=0.1)
    both = np.concatenate([words, input_words(p, rest)])
    results, _ = exact_sensors.run_words(FILTER, both, QUICK, word)
    out = {n: v[: len(words)] for n, v in results.items()}
    assert np.abs(np.linalg.norm(attitude_of(out), axis=-1) - 1.0).max() < 16 * 2.0 ** (2 - word)
    assert np.abs(out["pitch"][bits(out) & 1 == 0]).max() <= 0.5
    assert apart(results, q)[-1].max() < 1.0
    if word < 32:
        return  # the float run knows no width
    x = np.stack([p.format(n).real(words[:, k]) for k, n in enumerate(p.inputs)], axis=1)
    floats = run_float(np.concatenate([x, rest]), QUICK)
    for value in floats.values():
        assert np.isfinite(value).all()
    assert apart(floats, q)[-1].max() < 1.0
    seen = np.bitwise_or.reduce(bits(floats), axis=None)
    assert seen == 0xFF  # garbage reaches every bit


# -- (d) the two forms of the attitude ------------------------------------------------------------


def test_quaternion_and_euler_outputs_agree() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(250) * 0.02
    euler = np.stack(
        [
            np.radians(80) * np.sin(t * rng.uniform(0.5, 2, (6, 1))).T,
            (t * rng.uniform(-3, 3, (6, 1))).T,
            (t * rng.uniform(-3, 3, (6, 1))).T,
        ],
        -1,
    )
    out = run_fixed(records(euler_to_quaternion(euler), 0.02))
    angles = np.stack([out[n] for n in ("pitch", "roll", "heading")], axis=-1) * np.pi
    q = attitude_of(out)
    unit = 2.0**-30
    assert np.abs(q - euler_to_quaternion(angles)).max() < 6 * unit
    assert np.abs(np.linalg.norm(q, axis=-1) - 1.0).max() < 6 * unit
    scipys = Rotation.from_euler("ZXY", angles[..., [2, 0, 1]].reshape(-1, 3)).as_quat()
    scipys = scipys[:, [3, 0, 1, 2]]
    sign = np.sign((scipys * q.reshape(-1, 4)).sum(axis=-1, keepdims=True))
    assert np.abs(scipys * sign - q.reshape(-1, 4)).max() < 6 * unit
    assert np.abs(out["pitch"]).max() > 0.4


# -- (e) fixed point against float ----------------------------------------------------------------


@pytest.mark.parametrize(("word", "bound"), [(32, 1e-4), (28, 1e-3), (24, 2e-2)])
def test_fixed_equals_float_in_motion(word: int, bound: float) -> None:
    """Everything at once: motion, noise, bias, sparse magnetometer, by word width."""
    rng = np.random.default_rng(11)
    t = np.arange(400) * 0.02
    euler = np.stack(
        [
            np.radians(a) * np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 4))
            for a, f in ((60, 0.3), (90, 0.2), (170, 0.1))
        ],
        axis=-1,
    )
    x = records(euler_to_quaternion(euler), 0.02)
    x[:, GYR] += rng.normal(0.01, 0.02, x[:, GYR].shape)
    x[:, ACC] += rng.normal(0.0, 0.3, x[:, ACC].shape)
    x[:, MAG] += rng.normal(0.0, 0.5, x[:, MAG].shape)
    x[rng.random(len(t)) < 0.5, MAG] = 0.0
    m = machine(4, word=word)
    words = input_words(m.program, x)
    exact = np.stack(
        [m.program.format(n).real(words[:, k]) for k, n in enumerate(m.program.inputs)], axis=1
    )
    fixed, floats = real(m, m.run(words)[0]), run_float(exact)
    error = apart(fixed, attitude_of(floats))[10:].max()
    assert 1e-3 * bound < error < bound
