"""`ekf_bias`: start, missing samples, gates, bias, limits, fixed point, cycles, and its peers.

What it computes is in `test_ekf_textbook.py`; here is how it behaves.
"""

from functools import partial
from typing import Any

import numpy as np

from boresight.model.attitude.ekf_bias import BIAS_UNIT, EkfBias
from boresight.sim.accuracy.runs import run_peer
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error, attitude_of
from boresight.sim.rotations.rotation import quaternion_multiply, rotation_vector_to_quaternion
from tests.support import exact_sensors
from tests.support.exact_sensors import GRAVITY, GRID, GYR, MAG, apart, at_rest, bits

FILTER = EkfBias()
FIELD = np.array([0.0, 18.0, -45.0])
ALIGNED = 18  #: samples until it is surely aligned
RESIDUAL = 0.05  #: deg, what the last step of the alignment may leave

static = partial(at_rest, dt=0.01, field=FIELD)


def run_float(x: Any, params: Any = None) -> Any:
    return exact_sensors.run_float(FILTER, x, params)


def run_fixed(x: Any, params: Any = None) -> Any:
    return exact_sensors.run_fixed(FILTER, x, params)


def test_heading_aligns_with_the_first_field() -> None:
    """Tilt alone before it; the reference field is learnt, whatever its strength and dip."""
    q = GRID[:60:7]
    for field in (FIELD, np.array([0.0, 30.0, 20.0])):
        x = static(q, 120, field=field)
        x[:50, MAG] = 0.0
        out = run_float(x)
        assert attitude_error(attitude_of(out)[49], q).inclination.max() < RESIDUAL
        assert (bits(out)[10:50] == 2 + 8).all()
        assert not bits(out)[80:].any()
        assert apart(out, q)[80:].max() < RESIDUAL


def test_without_a_magnetometer_for_ever_the_tilt_is_kept() -> None:
    x = static(GRID[:5], 2000, dt=0.05)
    x[:, MAG] = 0.0
    x[:, GYR] = 0.01
    out = run_fixed(x)
    assert attitude_error(attitude_of(out)[-1], GRID[:5]).inclination.max() < 0.2


def test_bias_is_learnt_in_all_axes_and_taken_off() -> None:
    bias = np.array([0.01, -0.02, 0.015])
    q = GRID[40:42]
    x = static(q, 6000, dt=0.02)
    x[:, GYR] += bias[:, None]
    out = run_fixed(x)
    for k, axis in enumerate("xyz"):
        assert np.abs(out[f"next_bias_{axis}"][-1] - bias[k]).max() < 1e-3
    assert apart(out, q)[-1].max() < 0.4


def test_restart_forgets_everything() -> None:
    x = np.concatenate([static(GRID[:5], 300), static(GRID[40:45], 60)])
    x[:300, GYR] += 0.02
    x[300, 0] = -0.01
    again, first = run_float(x), run_float(static(GRID[40:45], 59))
    assert (bits(again)[300] & 3 == 3).all()
    assert apart({k: v[-1:] for k, v in again.items()}, attitude_of(first)[-1]).max() < 1e-6
    out = run_fixed(x[:301])
    assert max(np.abs(out[f"next_bias_{a}"][300]).max() for a in "xyz") == 0.0
    assert np.abs(out["next_p44"][300] - (3.5e-3 * BIAS_UNIT * 8.0) ** 2).max() < 1e-6


def test_disturbed_field_is_gated_and_said() -> None:
    q = GRID[:6]
    x = static(q, 400)
    x[200:, MAG] = x[200:, MAG] * 1.5
    out = run_fixed(x, {"mag_rate_per_s": 0.0})
    assert (bits(out)[200:] == 16).all()
    assert apart(out, q)[-1].max() < RESIDUAL
    followed = run_float(x, {"mag_gate": 3.9, "mag_rate_per_s": 5.0})
    assert not bits(followed)[200:].any()


def test_accelerometer_counts_less_when_the_force_is_not_g() -> None:
    """A sideways push of 0.5 g: the tilt error shrinks with the adaptive noise."""
    q = np.array([[1.0, 0.0, 0.0, 0.0]])
    x = static(q, 300)
    x[200:, 7] = 0.5 * GRAVITY
    tilt = [apart(run_float(x, {"acc_sd": 0.1, "acc_sd_per_g": c}), q)[-1, 0] for c in (0.0, 4.0)]
    assert tilt[1] < 0.25 * tilt[0]


def test_rotation_is_followed_through_any_attitude() -> None:
    rate = np.array([2.0, -1.5, 1.0])
    steps = rotation_vector_to_quaternion(np.arange(1, 401)[:, None] * 0.01 * rate)
    q = np.concatenate([np.repeat(GRID[3][None], 100, axis=0), quaternion_multiply(GRID[3], steps)])
    x = np.concatenate([static(at[None], 1) for at in q])
    x[100:, GYR] = rate[:, None]
    assert apart(run_fixed(x), q[:, None])[ALIGNED:].max() < 0.1


# -- recorded data ---------------------------------------------------------------------------------


def from_c(log: Any) -> Any:
    return {name: v[:, 0] for name, v in run_fixed(feed(FILTER, log).inputs[:, :, None]).items()}


def test_agrees_with_vqf() -> None:
    """On a walk with the sensor on the foot, and on the synthetic log: mean difference [deg].

    The walk has blows of several g at each step, and a field too disturbed to compare headings.
    """
    for name, kind, bound in (("ximu_walk", "inclination", 3.6), ("synthetic_60s", "total", 0.9)):
        log = read_record(bundled(name))
        other = run_peer("vqf_online", log)
        difference = getattr(attitude_error(attitude_of(from_c(log)), other), kind)[500:]
        assert 0.05 < difference.mean() < bound


def test_accuracy_on_the_synthetic_log() -> None:
    log = read_record(bundled("synthetic_60s"))
    error = attitude_error(attitude_of(from_c(log)), NineAxis.of(log).attitude).total[500:]
    assert np.sqrt(np.mean(error**2)) < 1.1


def test_strong_field_at_the_start_is_clamped_not_saturated() -> None:
    run_fixed(static(GRID[:3], 60, field=np.array([0.0, 250.0, -250.0])))
