"""The flagship filter: alignment, convergence, bias, magnet, rates, missing data, restart.

Float runs check the mathematics; `test_filter_fixed.py` checks that the program does the same.
"""

from typing import Any

import numpy as np
import pytest

from boresight.model.attitude.mekf import BIAS_SCALE, PAIRS, Mekf, covariance_name
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rotate,
)
from tests.support.compiled_float import compiled_float

GRAVITY = 9.80665
FIELD = np.array([0.0, 18.0, -40.0])
GYR, MAG, ACC = slice(1, 4), slice(4, 7), slice(7, 10)


def attitudes(seconds: float, hz: float, amplitude: float = 1.0) -> Any:
    """Attitudes (steps, 1, 4) of a smooth motion that is the same at any rate."""
    t = np.arange(round(seconds * hz)) / hz
    euler = np.stack(
        [
            amplitude * a * np.sin(2 * np.pi * f * t)
            for a, f in ((0.7, 0.23), (1.2, 0.31), (2.0, 0.11))
        ],
        axis=-1,
    )
    return euler_to_quaternion(euler)[:, None]


def records(q: Any, dt: float, field: Any = FIELD) -> Any:
    """Input records (steps, 10, runs) of exact sensors on attitudes (steps, runs, 4)."""
    turn = quaternion_to_rotation_vector(quaternion_multiply(quaternion_conjugate(q[:-1]), q[1:]))
    turn = np.concatenate([np.zeros_like(turn[:1]), turn])
    to_body = quaternion_conjugate(q)
    step = np.full((*q.shape[:2], 1), dt)
    x = [step, turn / dt, rotate(to_body, field), rotate(to_body, [0.0, 0.0, GRAVITY])]
    return np.moveaxis(np.concatenate(x, axis=-1), 1, 2)


def static(euler_deg: Any, seconds: float, dt: float = 0.01) -> Any:
    q = np.atleast_2d(euler_to_quaternion(np.radians(np.asarray(euler_deg, dtype=float))))
    return records(np.broadcast_to(q, (round(seconds / dt), *q.shape)), dt), q


def run(x: Any, params: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Outputs and states by name, (steps, runs)."""
    return compiled_float(Mekf(), x, params)


def apart(out: Any, q: Any) -> Any:
    """Angle [deg] between outputs and attitudes (..., 4)."""
    actual = np.stack([out[name] for name in ("qw", "qx", "qy", "qz")], axis=-1)
    error = quaternion_multiply(quaternion_conjugate(q), actual)
    return np.degrees(np.linalg.norm(quaternion_to_rotation_vector(error), axis=-1))


def bit(out: Any, number: int) -> Any:
    return (np.rint(out["status"]).astype(int) >> number) & 1


def test_euler_angles_are_those_of_the_quaternion() -> None:
    q = attitudes(3.0, 100.0)
    out, _ = run(records(q, 0.01))
    actual = np.stack([out[n][5:, 0] * np.pi for n in ("pitch", "roll", "heading")], axis=-1)
    same = {k: v[5:] for k, v in out.items()}
    assert apart(same, euler_to_quaternion(actual)[:, None]).max() < 1e-6


def test_it_follows_exact_sensors() -> None:
    q = attitudes(10.0, 100.0)
    out, _ = run(records(q, 0.01))
    assert apart(out, q)[5:].max() < 0.05


def test_a_wrong_start_is_forgotten() -> None:
    """Five bad samples of accelerometer and magnetometer; then the truth wins."""
    x, q = static([10.0, -20.0, 30.0], 90.0, 0.1)
    x[:5, ACC] += np.array([3.0, -2.0, 0.0])[:, None]
    x[:5, MAG] += np.array([6.0, -4.0, 0.0])[:, None]
    error = apart(run(x)[0], q)
    assert error[5].max() > 5.0
    assert error[-1].max() < 0.1 * error[5].max()


def test_it_learns_the_bias_at_rest_and_without() -> None:
    bias = np.array([0.008, -0.006, 0.004])
    x, _ = static([10.0, -20.0, 30.0], 25.0, 0.04)
    x[:, GYR, 0] += bias
    out, states = run(x)
    actual = np.stack([states[f"bias_{a}"][-1, 0] for a in "xyz"])
    assert bit(out, 5)[-1].all()
    assert np.abs(actual - bias).max() < 2e-5
    out, states = run(x, {"rest_motion_sq": 0.0, "p0_bias": 6e-5})
    assert not bit(out, 5).any()
    actual = np.stack([states[f"bias_{a}"][-1, 0] for a in "xyz"])
    assert np.abs(actual - bias)[:2].max() < 2e-3  # tilt shows it; heading is slower


def _with_magnet() -> tuple[Any, Any]:
    """Motion at 25 Hz; from 30 s on for 8 s a magnet stands beside the body."""
    q = attitudes(40.0, 25.0)
    x = records(q, 0.04)
    disturbed = records(q, 0.04, FIELD + [14.0, -6.0, 9.0])
    x[750:950, MAG] = disturbed[750:950, MAG]
    return x, q


def test_a_magnet_does_not_take_the_heading_along() -> None:
    x, q = _with_magnet()
    out, _ = run(x)
    trusting = apart(run(x, {"field_trust_s": 0.0})[0], q)[750:].max()
    assert trusting > 40.0
    assert apart(out, q)[750:].max() < 0.3 * trusting
    assert bit(out, 4)[760:950].all() and not bit(out, 4)[200:750].any()


def test_a_deviation_is_remembered_for_a_while() -> None:
    """`field_forget_per_s`: a second after the magnet has gone the field still counts as odd."""
    x, _ = _with_magnet()
    slow, gone = (run(x, {"field_forget_per_s": f})[1]["odd_sq"][:, 0] for f in (0.4, 30.0))
    assert slow[949] == pytest.approx(gone[949], rel=0.05)
    assert slow[975] > 0.5 * slow[949] > 2.0 * gone[975]


def test_a_lasting_field_becomes_the_reference() -> None:
    q = attitudes(40.0, 50.0)
    x = records(q, 0.02)
    x[500:, MAG] *= 1.5
    out, states = run(x, {"field_follow_per_s": 0.2})
    assert bit(out, 4)[600].all() and not bit(out, 4)[-1].any()
    assert states["horizontal"][-1, 0] == pytest.approx(27.0, rel=0.02)


@pytest.mark.parametrize("hz", [50.0, 100.0, 300.0])
def test_gain_and_covariance_do_not_depend_on_the_rate(hz: float) -> None:
    """A jump of the heading by 10 deg that the gyro did not see decays alike at every rate."""
    steps = round(10.0 * hz)
    x, _ = static([0.0, 0.0, 0.0], 10.0, 1 / hz)
    jump = np.radians(10.0)
    turned = rotate(np.array([np.cos(jump / 2), 0.0, 0.0, -np.sin(jump / 2)]), FIELD)
    x[round(hz) :, MAG, 0] = turned
    quiet = {"rest_motion_sq": 0.0, "start_var": 0.0, "field_trust_s": 0.0}
    out, states = run(x, quiet | {"heading_var": 0.1})
    result = 10.0 - np.abs(out["heading"][:, 0] * 180.0)
    assert result[steps // 2] == pytest.approx(4.1, abs=0.1)
    sd = np.degrees(np.sqrt(states["p_uu"][-1, 0]))
    assert sd == pytest.approx(5.74, abs=0.05)


def test_missing_magnetometer() -> None:
    """Bit 1 until the first sample, bit 3 while it is missing; heading by the gyro meanwhile."""
    q = attitudes(10.0, 100.0)
    x = records(q, 0.01)
    x[:100, MAG] = 0.0
    x[500:, MAG] = 0.0
    out, _ = run(x)
    assert bit(out, 1)[:100].all() and not bit(out, 1)[103:].any()
    assert bit(out, 3)[:100].all() and not bit(out, 3)[100:500].any() and bit(out, 3)[500:].all()
    assert apart(out, q)[103:].max() < 0.2


def test_missing_accelerometer() -> None:
    """Zero force: the tilt is kept by the gyro, bit 2 comes up, alignment waits."""
    q = attitudes(10.0, 100.0)
    x = records(q, 0.01)
    x[300:800, ACC] = 0.0
    out, _ = run(x)
    assert bit(out, 2)[700:800].all() and not bit(out, 2)[2:300].any()
    assert apart(out, q)[5:].max() < 0.5
    x[:100, ACC] = 0.0
    out, _ = run(x)
    assert bit(out, 0)[:100].all() and not bit(out, 0)[100:].any()
    assert apart(out, q)[100:].max() < 0.5


@pytest.mark.parametrize("rows", [1500, 1501, 1502])
def test_restart_forgets_everything(rows: int) -> None:
    """At 300 Hz, every third sample an update: whose turn it is, and since when, too."""
    first = records(attitudes(6.0, 300.0, 0.8), 1.0 / 300.0)[:rows]
    first[:, GYR] += 0.02
    second = records(attitudes(3.0, 300.0), 1.0 / 300.0)
    fresh, after_fresh = run(second)
    both = np.concatenate([first, second])
    both[len(first), 0] = -0.25
    out, states = run(both)
    for name in ("qw", "qx", "qy", "qz", "heading", "status"):
        assert np.abs(out[name][len(first) :] - fresh[name]).max() < 1e-9
    assert np.abs(states["bias_x"][len(first)]).max() == 0.0
    # The field's reference and its deviation are those of the first sample one sample later.
    for name, values in after_fresh.items():
        assert np.abs(states[name][len(first) + 1 :] - values[1:]).max() < 1e-9, name


def _cut(seconds: float, gap_s: float) -> tuple[Any, Any, int]:
    """Learnt motion with a bias, then samples missing at 8 s; the first row after them."""
    q = attitudes(12.0, 100.0, 0.5)
    x = records(q, 0.01)
    x[:, GYR] += np.array([0.01, -0.008, 0.006])[:, None]
    lost = round(100 * seconds)
    x[800 + lost, 0] = gap_s
    rows = np.r_[:800, 800 + lost : len(q)]
    return x[rows], q[rows], 800


def test_a_gap_is_turned_through() -> None:
    """0.3 s without samples, of which the step tells: the attitude goes on as the gyro turned."""
    x, q, at = _cut(0.3, 0.25 - 0.31)
    out, states = run(x)
    error = apart(out, q)[:, 0]
    moved = apart({k: v[at - 1 : at] for k, v in out.items()}, q[at])[0, 0]
    assert moved > 2.5 * error[at]
    assert error[at:].max() < 6.0 and error[at + 100 :].max() < error[at - 1]
    assert states["p_ee"][at, 0] > 2.0 * states["p_ee"][at - 1, 0]
    young = np.sum(x[at, GYR] ** 2)  # half of it is left after a step of 0.31 s
    assert states["youth"][at, 0] == pytest.approx(young - 0.5 * young, abs=2e-6)
    assert states["bias_x"][at, 0] == pytest.approx(states["bias_x"][at - 1, 0], abs=1e-3)


def covariance(states: Any) -> Any:
    p = np.zeros((len(states["p_ee"]), 6, 6))
    for i, j in PAIRS:
        p[:, i, j] = p[:, j, i] = states[covariance_name(i, j)][:, 0]
    return p


def test_covariance_is_that_of_the_matrix_equations() -> None:
    """One step of textbook matrices: joint scalar update, bias update of gain k, prediction."""
    q = attitudes(4.0, 100.0)
    x = records(q, 0.01)
    x[:, GYR] += np.random.default_rng(5).normal(0.0, 0.5, x[:, GYR].shape)
    out, states = run(x)
    p = covariance(states)
    scale = np.diag([1.0] * 3 + [1 / BIAS_SCALE] * 3)
    values = Mekf().param_values()
    checked = 0
    for k in range(50, 390):
        turn, dt = states["turn"][k - 1, 0], 0.01
        axis = 0 if turn < 0.0 else 2 if turn >= 1.0 else 1
        h = np.eye(6)[axis]
        var = values["tilt_var"]
        if axis == 2:
            m = [states[f"field_{a}"][k - 1, 0] for a in "enu"]
            dip_sq = m[2] ** 2 / (m[0] ** 2 + m[1] ** 2)
            var = values["heading_var"] + values["field_trust_s"] * states["odd_sq"][k, 0]
            var += values["dip_trust_s"] * dip_sq * p[k - 1][1, 1]
        before = scale @ p[k - 1] @ scale
        gain = before @ h / (h @ before @ h + var / (3 * dt))
        updated = (np.eye(6) - np.outer(gain, h)) @ before
        c = rotate(np.array([out[n][k, 0] for n in ("qw", "qx", "qy", "qz")]), np.eye(3)).T
        phi = np.eye(6)
        phi[:3, 3:] = -c * dt
        w = x[k, GYR, 0]
        growth = np.diag(
            [(values["gyro_var"] + values["gyro_scale_var"] * w @ w) * dt] * 3
            + [values["bias_var"] * dt] * 3
        )
        more = values["start_var"] * states["youth"][k - 1, 0] ** 2 * dt
        growth += np.diag([more] * 3 + [0.0] * 3)
        # the bias's own noise enters before the transition; A P_bb A^T is counted once more
        updated[3:, 3:] += growth[3:, 3:]
        growth[3:, 3:] = 0.0
        want = phi @ updated @ phi.T + growth
        want[:3, :3] += (c * dt) @ updated[3:, 3:] @ (c * dt).T
        result = scale @ p[k] @ scale
        assert np.abs(result - want).max() < 1e-9 * np.abs(want).max()
        checked += 1
    assert checked == 340


def test_covariance_stays_positive_and_bounded() -> None:
    """Without any measurement it stops growing; with them every eigenvalue stays positive."""
    q = attitudes(15.0, 50.0)
    x = records(q, 0.02)
    p = covariance(run(x)[1])
    assert np.linalg.eigvalsh(p)[:].min() > 0.0
    x[50:, MAG] = 0.0
    x[50:, ACC] = 0.0
    p = covariance(run(x, {"gyro_var": 0.0156, "gyro_scale_var": 0.0039, "bias_var": 1e-7})[1])
    trace = np.trace(p, axis1=1, axis2=2)
    assert 0.5 < trace.max() < 6.0
    assert np.linalg.eigvalsh(p).min() > 0.0


def _fast_turn(most: float, seconds: float = 0.1) -> tuple[Any, Any, Any]:
    """A turn at 10 s by 30 rad/s about x, measured up to ``most``; the first row after it."""
    hz = 200
    t = np.arange(14 * hz) / hz
    part = np.interp(t, 10.0 + np.cumsum([0.0, 0.1, seconds, 0.1]), [0.0, 1.0, 1.0, 0.0])
    angle = 30.0 * np.cumsum(part) / hz
    zero = np.zeros_like(angle)
    turned = np.stack([np.cos(0.5 * angle), np.sin(0.5 * angle), zero, zero], axis=-1)
    q = quaternion_multiply(attitudes(14.0, hz, 0.2)[:, 0], turned)[:, None]
    x = records(q, 1 / hz)
    x[:, GYR] = np.clip(x[:, GYR], -most, most)
    return x, q, round((10.2 + seconds) * hz)


def test_a_true_full_scale_is_used() -> None:
    """What is missed, or extrapolated beyond it, is soon found again; a bit tells."""
    x, q, after = _fast_turn(28.0)
    out, states = run(x, {"gyro_most_sq": (0.98 * 28.0) ** 2})
    error = apart(out, q)[:, 0]
    late = apart(run(x)[0], q)[:, 0]  # not told of its full scale
    assert error[: after + 10].max() < 13.0
    assert late[after + 100] > 2.0 * error[after + 100]
    assert error[after + 100 :].max() < 5.0
    assert bit(out, 6)[after : after + 400].all() and not bit(out, 6)[:2000].any()
    assert states["youth"][after, 0] > 0.5 > 0.01 > states["youth"][1999, 0]
    assert states["beyond"][after, 0] == 0.0 < states["beyond"][2030, 0]


def test_most_of_a_swing_beyond_full_scale_is_extrapolated() -> None:
    """Its rate is a sine up to 12.5 rad/s, measured up to 10: the attitude misses half at most."""
    hz = 200
    t = np.arange(12 * hz) / hz
    swing = np.where(t < 10.0, 0.0, 1.0 - np.cos(2.0 * np.pi * 1.5 * (t - 10.0)))
    swing[t > 10.0 + 1.0 / 3.0] = 2.0
    angle = 12.5 / (2.0 * np.pi * 1.5) * swing
    zero = np.zeros_like(angle)
    turned = np.stack([np.cos(0.5 * angle), np.sin(0.5 * angle), zero, zero], axis=-1)
    q = quaternion_multiply(attitudes(12.0, hz, 0.2)[:, 0], turned)[:, None]
    x = records(q, 1 / hz)
    x[:, GYR] = np.clip(x[:, GYR], -10.0, 10.0)
    after = round(10.34 * hz)
    assert apart(run(x)[0], q)[after, 0] > 6.0
    assert apart(run(x, {"gyro_most_sq": 9.8**2})[0], q)[after, 0] < 3.0


@pytest.mark.parametrize("full_deg_s", [300.0, 1000.0, 2000.0])
def test_after_turns_beyond_full_scale_the_attitude_returns(full_deg_s: float) -> None:
    """Below 5 deg within 1.5 s, whatever the axis, the turn's length and its rate, up to 1.5 of it.

    Force and field are good: white noise, 0.2 m/s^2 of slow accelerations.
    """
    hz, runs = 200, 24
    rng = np.random.default_rng(int(full_deg_s))
    t = np.arange(14 * hz) / hz
    full = np.radians(full_deg_s)
    way = rng.standard_normal((runs, 3))
    way[::3] = np.eye(3)[rng.integers(3, size=runs)][::3]
    size = rng.uniform(1.02, 1.5, runs) * full / np.abs(way).max(axis=1)
    seconds = rng.uniform(0.02, 0.25, runs)
    corners = 10.0 + np.cumsum([np.zeros(runs), np.full(runs, 0.1), seconds, np.full(runs, 0.1)], 0)
    part = np.stack([np.interp(t, c, [0.0, 1.0, 1.0, 0.0]) for c in corners.T], axis=1)
    angle = size * np.cumsum(part, axis=0) / hz  # (steps, runs)
    axis = way / np.linalg.norm(way, axis=1, keepdims=True)
    half = 0.5 * angle * np.linalg.norm(way, axis=1)
    turned = np.concatenate([np.cos(half)[..., None], np.sin(half)[..., None] * axis], axis=-1)
    start = euler_to_quaternion(rng.uniform(-3.0, 3.0, (runs, 3)) * [0.5, 1.0, 1.0])
    q = quaternion_multiply(start, quaternion_multiply(attitudes(14.0, hz, 0.3), turned))
    x = records(q, 1 / hz)
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, runs))
    slow = 0.28 * np.sin(
        2.0 * np.pi * np.array([0.7, 0.5, 0.3])[:, None] * t[:, None, None] + phase
    )
    to_body = quaternion_conjugate(q)
    x[:, ACC] += np.moveaxis(rotate(to_body, np.moveaxis(slow, 1, 2)), 1, 2)
    for sensor, sd in ((GYR, 0.003), (ACC, 0.05), (MAG, 0.3)):
        x[:, sensor] += sd * rng.standard_normal(x[:, sensor].shape)
    x[:, GYR] = np.clip(x[:, GYR], -full, full)
    error = apart(run(x, {"gyro_most_sq": (0.98 * full) ** 2})[0], q)
    after = t[:, None] > corners[-1] + 1.5
    assert (np.abs(x[:, GYR]) == full).any(axis=(0, 1)).sum() > 0.8 * runs
    assert error[after].max() < 5.0


def test_an_accelerometer_at_full_scale_is_not_believed() -> None:
    """For 0.2 s one axis says 5 g."""
    q = attitudes(12.0, 100.0, 0.2)
    x = records(q, 0.01)
    x[1000:1020, 7] = 49.0
    assert apart(run(x)[0], q)[1000:].max() > 10.0
    error = apart(run(x, {"force_most_sq": 38.0**2})[0], q)
    assert error[1000:].max() < 1.0


def test_growth_of_the_covariance_ends() -> None:
    x, _ = static([0.0, 0.0, 0.0], 200.0, 0.2)
    x[5:, MAG] = 0.0
    x[5:, ACC] = 0.0
    out, states = run(x, {"gyro_var": 0.0156, "bias_var": 1e-7})
    trace = np.trace(covariance(states), axis1=1, axis2=2)
    assert 1.6 < trace[-1] < 1.8
    assert trace[-1] == trace[-100]
