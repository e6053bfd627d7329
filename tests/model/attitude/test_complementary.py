"""The complementary filter: convergence, alignment, bad input, the vertical, the printed eq. (3).

Float runs check the mathematics; fixed-point runs check that the program does the same.
"""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude.complementary import (
    Complementary,
    ComplementaryAsPrinted,
    per_sample_gains,
)
from boresight.model.estimator import input_words
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_multiply,
    quaternion_to_euler,
    rotation_vector_to_quaternion,
)
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


def run_float(x: Any, params: Any = None, cls: Any = Complementary) -> Any:
    return exact_sensors.run_float(cls(), x, params)


def machine(runs: int, params: Any = None, word: int = 32) -> Any:
    return exact_sensors.machine(Complementary(), runs, params, word)


def run_fixed(x: Any, params: Any = None, cls: Any = Complementary, word: int = 32) -> Any:
    return exact_sensors.run_fixed(cls(), x, params, word)


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


@both
def test_rare_magnetometer_samples_count_for_the_time_they_stand_for(run: Any) -> None:
    q = np.concatenate(
        [np.repeat(degrees(0, 0, 0)[None], 3, 0), np.repeat(degrees(0, 0, 6)[None], 60, 0)]
    )[:, None]
    x = records(np.repeat(q, 2, axis=1), 0.05)
    x[:, GYR] = 0.0
    present = np.arange(len(x)) % 10 == 2
    x[~present, MAG, 1] = 0.0
    out = run(x, GYRO_ONLY | {"kp_heading_per_s": 0.4})
    remaining = 6.0 - 180.0 * out["heading"][62]
    assert remaining[0] == pytest.approx(6.0 * math.exp(-0.4 * 3.0), rel=0.05)
    assert remaining[1] == pytest.approx(6.0 * (1 - 0.4 * 0.5) ** 6, rel=0.02)


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


def test_a_bias_is_learnt_in_body_axes_at_any_attitude() -> None:
    bias = np.array([0.01, -0.008, 0.006])
    x = static(degrees([35, -35, 0, 60], [50, 140, -90, 10], [20, 0, 0, 0]), 500)
    x[:, GYR] += bias[:, None]
    m = machine(
        4,
        {name: 1.0 for name in QUICK}
        | {"ki_pitch_per_s2": 0.25, "ki_roll_per_s2": 0.25, "ki_heading_per_s2": 0.25},
    )
    m.run(input_words(m.program, x))
    numbers = [m.program.find(f"bias_{axis}") for axis in "xyz"]
    values = np.stack([m.program.format(n).real(m.values[n]) for n in numbers], axis=-1)
    assert np.abs(values - bias).max() < 1e-4


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


def test_the_learnt_bias_is_limited() -> None:
    x = static(degrees(0, 0, 0)[None], 300)
    x[:, 1] += 0.5
    m = machine(1, {"ki_pitch_per_s2": 1.0})
    m.run(input_words(m.program, x))
    n = m.program.find("bias_x")
    assert m.program.format(n).real(m.values[n])[0] == pytest.approx(1 / 32, rel=1e-6)


def test_gains_per_sample() -> None:
    """x -= Kp e, I += Ki e at 8 Hz, as printed in Table 4."""
    assert per_sample_gains(0.1414, 5e-7, 8.0) == pytest.approx((1.1312, 3.2e-5))
    kp, _ = per_sample_gains(0.1, 0.0, 20.0)
    x = records(
        np.concatenate(
            [np.repeat(degrees(0, 0, 0)[None], 3, 0), np.repeat(degrees(4, 0, 0)[None], 1, 0)]
        )[:, None],
        0.05,
    )
    x[:, GYR] = 0.0
    out = run_float(x, GYRO_ONLY | {"kp_pitch_per_s": kp})
    assert out["pitch"][3, 0] * 180 == pytest.approx(0.4, rel=0.002)


# -- (b) alignment and status ---------------------------------------------------------------------


@both
def test_alignment_takes_roll_then_pitch_then_heading(run: Any) -> None:
    q = degrees(35.0, -70.0, 110.0)[None]
    out = run(static(q, 4))
    values = np.stack([out[n][:, 0] * 180 for n in ("pitch", "roll", "heading")], axis=-1)
    assert np.abs(values - [[0, -70, 0], [35, -70, 0], [35, -70, 110], [35, -70, 110]]).max() < 1e-4
    assert bits(out)[:, 0].tolist() == [0b11, 0b11, 0, 0]


@both
def test_status_without_accelerometer_at_the_start(run: Any) -> None:
    """Zero force has no direction: alignment waits, bit 2, and goes on when force comes."""
    q = degrees(30.0, 20.0, -60.0)[None]
    x = static(q, 9)
    x[:3, ACC] = 0.0
    x[4, ACC] = 0.0
    out = run(x)
    assert bits(out)[:, 0].tolist() == [0b111, 0b111, 0b111, 0b11, 0b111, 0b11, 0, 0, 0]
    assert apart(out, q)[6:].max() < 1e-4


@both
def test_status_without_magnetometer(run: Any) -> None:
    """Bit 3 says so; bit 1 stays until the first sample; bit 4 is not about missing samples."""
    q = degrees(-20.0, 40.0, 75.0)[None]
    x = static(q, 8)
    x[:5, MAG] = 0.0
    x[6, MAG] = 0.0
    out = run(x)
    assert bits(out)[:, 0].tolist() == [0b1011, 0b1011, 0b1010, 0b1010, 0b1010, 0, 0b1000, 0]
    assert np.abs(out["heading"][:5]).max() < 1e-6
    assert apart(out, q)[5:].max() < 1e-4


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
def test_the_fields_mean_follows_in_time_not_in_samples(run: Any) -> None:
    """With every fifth sample only it takes as long."""
    x = static(degrees(10.0, -15.0, 40.0)[None], 120)
    x[20:, MAG] *= 2.0
    x[np.arange(120) % 5 != 0, MAG] = 0.0
    status = bits(run(x, {"mag_rate_per_s": 1.0}))[:, 0]
    used_again = 0.05 * np.flatnonzero(status[20:] & 0b10000)[-1]
    assert used_again == pytest.approx(math.log(3 / (4 - 4 / 1.4)), abs=0.3)


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


@both
def test_near_vertical_is_flagged(run: Any) -> None:
    """1/cos(pitch) is limited from 89.1 deg on."""
    out = run(static(degrees([89.0, 89.2, 89.9, -89.0, -89.2], 10.0, 20.0), 4))
    assert bits(out)[3].tolist() == [0, 0b1000000, 0b1000000, 0, 0b1000000]


@both
def test_passing_the_vertical_is_flagged_once(run: Any) -> None:
    """Pitch 80 to 100 deg: seen as 80, with roll and heading turned by half a turn."""
    pitch = np.arange(70.25, 110.0, 0.5)
    q = at_rest_first(degrees(pitch, 30.0, 50.0)[:, None])
    out = run(records(q, 0.02))
    flagged = np.flatnonzero(bits(out)[:, 0] >> 7 & 1)
    assert flagged.tolist() == [5 + np.flatnonzero(pitch > 90.0)[0]]
    assert np.abs(out["pitch"]).max() <= 0.5
    assert wrapped_deg(out["roll"][-1, 0] - (30.0 - 180.0) / 180) == pytest.approx(0.0, abs=0.05)
    assert wrapped_deg(out["heading"][-1, 0] - (50.0 - 180.0) / 180) == pytest.approx(0.0, abs=0.05)
    assert out["pitch"][-1, 0] * 180 == pytest.approx(180.0 - pitch[-1], abs=0.05)
    assert apart(out, q)[2:].max() < 0.1


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


@both
def test_a_time_step_of_zero_changes_nothing(run: Any) -> None:
    x = static(degrees(10.0, 20.0, 30.0)[None], 8)
    x[5, DT] = 0.0
    x[5, GYR] = 30.0
    x[5, ACC] = np.array([3.0, -9.0, 1.0])[:, None]
    x[5, MAG] = np.roll(x[4, MAG], 1, axis=0)
    out = run(x)
    before, after = attitude_of(out)[4, 0], attitude_of(out)[5, 0]
    assert np.abs(after - before).max() <= 2.0**-29


@pytest.mark.parametrize("field", [True, False], ids=["field", "no field"])
def test_a_huge_gap_is_survived(field: Any) -> None:
    """30 s without samples, turned meanwhile: the step is cut to what a word holds."""
    q = np.concatenate(
        [
            np.repeat(degrees(0, 0, 0)[None], 5, 0),
            np.repeat(degrees(50.0, -80.0, 130.0)[None], 200, 0),
        ]
    )[:, None]
    x = records(q, 0.05)
    x[:, GYR] = 0.0
    x[5, DT] = 30.0
    x[5, GYR] = 3.0
    if not field:
        x[:, MAG] = 0.0
    for run in RUNS.values():
        out = run(x, QUICK)
        assert all(np.isfinite(v).all() for v in out.values())
        assert abs(out["pitch"][-1, 0] * 180 - 50.0) < 0.01
        if field:
            assert apart(out, q)[-1, 0] < 0.1


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
    m = machine(runs, QUICK, word)
    p = m.program
    words = garbage(rng, p.arithmetic, runs, 1000 if word == 32 else 300)
    q = degrees(rng.uniform(-60, 60, runs), *rng.uniform(-180, 180, (2, runs)))
    rest = static(q, 600, dt=0.1)
    out = real(m, m.run(words)[0])
    assert np.abs(np.linalg.norm(attitude_of(out), axis=-1) - 1.0).max() < 16 * 2.0 ** (2 - word)
    assert np.abs(out["pitch"][bits(out) & 1 == 0]).max() <= 0.5
    after = real(m, m.run(input_words(p, rest))[0])
    assert apart(after, q)[-1].max() < 1.0
    if word < 32:
        return  # the float run knows no width
    x = np.stack([p.format(n).real(words[:, k]) for k, n in enumerate(p.inputs)], axis=1)
    floats = run_float(np.concatenate([x, rest]), QUICK)
    for value in floats.values():
        assert np.isfinite(value).all()
    assert apart(floats, q)[-1].max() < 1.0
    seen = np.bitwise_or.reduce(bits(floats), axis=None)
    assert seen == 0xFF  # garbage reaches every bit


# -- (d) the vertical, wrapping -------------------------------------------------------------------


def loops(rate: float, roll: float, miss: float, seconds: float = 13.0) -> Any:
    """Turning about the body's pitch axis, over the top again and again, ``miss`` deg beside it."""
    t = np.arange(0.0, seconds, 0.01)
    euler = np.zeros((len(t), 3))
    euler[:, 0] = np.radians(3.0) + rate * t
    euler[:, 1] = np.radians(roll)
    tilt = quaternion_multiply(
        degrees(0, 0, 40), rotation_vector_to_quaternion(np.radians([0.0, miss, 0.0]))
    )
    return quaternion_multiply(tilt, euler_to_quaternion(euler))


#: (turning rate [rad/s], distance from the vertical [deg], bound of the error [deg])
LOOPS = (
    (0.5, 0.0, 0.003),
    (2.0, 0.0, 0.3),
    (0.5, 0.3, 1.5),
    (2.0, 0.3, 4.5),
    (2.0, 1.0, 1.2),
    (2.0, 5.0, 0.2),
    (4.0, 0.0, 15.0),
    (4.0, 0.3, 18.0),
)


@pytest.mark.parametrize(("rate", "miss", "bound"), LOOPS)
def test_loops_through_the_vertical(rate: float, miss: float, bound: float) -> None:
    """Exactly over the top the error stays small; beside it the roll swings faster than 64."""
    q = np.stack([loops(rate * s, roll, miss) for roll in (0, 50, -120, 170) for s in (1, -1)], 1)
    out = run_float(records(q, 0.01))
    error = apart(out, q)[50:]
    assert error.max() < bound
    passed = (bits(out) >> 7 & 1).sum(axis=0)
    if miss == 0.0 and rate <= 2.0:  # faster it may pass beside the pole instead
        half_turns = (13.0 * rate + math.radians(3.0)) / math.pi
        assert np.all(passed >= math.floor(half_turns))
    assert error.max() > 0.2 * bound


def test_fixed_follows_float_through_the_vertical() -> None:
    q = np.stack(
        [loops(s * 2.0, roll, 0.0, seconds=6.0) for roll in (0, 50, 170) for s in (1, -1)], axis=1
    )
    x = records(q, 0.01)
    fixed, floats = run_fixed(x), run_float(x)
    assert (bits(fixed) >> 7 & 1).sum() >= 18
    assert np.array_equal(bits(fixed), bits(floats))
    assert apart(fixed, attitude_of(floats))[3:].max() < 3e-4
    assert apart(fixed, q)[50:].max() < 0.02


def test_heading_wraps_exactly() -> None:
    """Uncorrected, a constant rate advances the word by the same amount across +-180 deg."""
    x = static(degrees(0, 0, 179.5)[None], 60)
    m = machine(1, GYRO_ONLY)
    m.run(input_words(m.program, x[:5]))
    x[:, 3] = 0.02
    out, saturated = m.run(input_words(m.program, x))
    heading = out[:, 2, 0]
    assert not saturated.any()
    assert heading[0] > 0 > heading[-1]
    steps = (np.diff(heading) + (1 << 31)) % (1 << 32) - (1 << 31)
    assert steps.max() - steps.min() <= 1
    assert steps.mean() == pytest.approx(0.02 * 0.05 / math.pi * 2**31, rel=1e-5)


@both
def test_a_full_turn_of_heading_and_roll(run: Any) -> None:
    """Corrections across the wrap: no jump, no wrong way round."""
    turn = np.linspace(0.0, 2 * np.pi, 150)
    euler = np.zeros((150, 2, 3))
    euler[:, 0, 2] = euler[:, 1, 1] = np.radians(150.0) + turn
    euler[:, :, 0] = np.radians(25.0)
    q = at_rest_first(euler_to_quaternion(euler))
    assert apart(run(records(q, 0.05)), q)[2:].max() < 0.04


# -- (e) the two forms of the attitude ------------------------------------------------------------


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


# -- (f) eq. (3) as printed -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def stage() -> Any:
    """Experiment E2: stacked stage Rx(a) Ry(b) Rz(c), Table 1: 15 deg, 4.25 periods each."""
    hz, angles, parts = 40.0, np.zeros(3), [np.zeros((1, 3))]
    for k, period in enumerate((25.0, 14.0, 5.0) * 2):
        t = np.arange(1, round(4.25 * period * hz) + 1) / hz
        part = np.tile(angles, (len(t), 1))
        wave = 2 * np.pi * t / period
        amplitude = math.radians(-15.0 if k % 3 == 0 else 15.0)
        part[:, k % 3] = amplitude * (np.sin(wave) if k < 3 else np.cos(wave))
        parts.append(part)
        angles = part[-1]
    q = Rotation.from_euler("XYZ", np.concatenate(parts)).as_quat()[:, [3, 0, 1, 2]]
    same = np.cumprod(np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    q[1:] *= same[:, None]
    x = records(q[:, None], 1 / hz)
    return np.concatenate([np.repeat(x[:1], 3, axis=0), x]), quaternion_to_euler(q) / np.pi


def euler_error(out: Any, euler: Any) -> Any:
    """Error (steps, 3) [deg] of pitch, roll, heading."""
    return np.stack(
        [
            wrapped_deg(out[n][3:, 0] - euler[:, k])
            for k, n in enumerate(("pitch", "roll", "heading"))
        ],
        axis=-1,
    )


def test_the_stage_is_table_1(stage: Any) -> None:
    x, euler = stage
    assert len(euler) == 374 * 40 + 1
    assert np.abs(euler[:, 0] * 180).max() == pytest.approx(18.34, abs=0.01)
    assert np.abs(euler[-1]).max() < 1e-12
    assert np.abs(x[:, GYR]).max() < 0.5


def stage_errors(stage: Any, cls: Any) -> Any:
    """Errors (steps, 3) [deg] with the gyro alone and with the letter's gains."""
    x, euler = stage
    gains = {"kp_pitch_per_s": 0.1414, "kp_roll_per_s": 0.1414, "kp_heading_per_s": 0.1}
    both = (GYRO_ONLY, GYRO_ONLY | gains)
    return [euler_error(run_float(x, params, cls), euler) for params in both]


def test_consistent_kinematics_follow_the_stage(stage: Any) -> None:
    gyro, both = stage_errors(stage, Complementary)
    assert np.abs(gyro).max() < 5e-5
    assert np.abs(both).max() < 4e-4


def test_printed_kinematics_do_not(stage: Any) -> None:
    """Two-sided bounds: whoever mends the printed equation hears of it here."""
    error, both = stage_errors(stage, ComplementaryAsPrinted)
    assert error.std(axis=0) == pytest.approx([0.2267, 0.2308, 1.9596], rel=0.01)
    assert np.abs(error).max(axis=0) == pytest.approx([0.687, 0.522, 4.056], rel=0.01)
    assert both.std(axis=0) == pytest.approx([0.1774, 0.1657, 1.6955], rel=0.01)
    assert np.abs(both).max(axis=0) == pytest.approx([0.4986, 0.5209, 4.0615], rel=0.01)


@pytest.mark.parametrize("cls", [Complementary, ComplementaryAsPrinted])
def test_fixed_equals_float_on_the_stage(stage: Any, cls: Any) -> None:
    x, _ = stage
    x = x[:600]
    fixed, floats = run_fixed(x, cls=cls), run_float(x, cls=cls)
    assert apart(fixed, attitude_of(floats))[2:].max() < 1e-4
    assert np.array_equal(bits(fixed), bits(floats))


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
