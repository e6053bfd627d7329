"""The quaternion EKFs."""

from functools import partial

import numpy as np

from boresight.model.algebra.quaternion_filter import START
from boresight.model.attitude.ekf_quaternion import EkfQuaternion
from boresight.sim.rotations.rotation import quaternion_multiply, rotation_vector_to_quaternion
from tests.support.exact_sensors import (
    ACC,
    GRID,
    GYR,
    MAG,
    apart,
    at_rest,
    bits,
    run_fixed,
    run_float,
)

# What they compute is in `test_ekf_textbook.py`; here is how they behave.

FILTER = EkfQuaternion()
FIELD = np.array([0.0, 14.7, -40.6])
ALIGNED = 6  #: samples until it is surely aligned

static = partial(at_rest, dt=0.01, field=FIELD)


def test_aligns_from_half_a_turn_away() -> None:
    """Where the error's axis cannot be told, rounding decides, and the filter still arrives."""
    half_turns = np.concatenate([np.eye(4)[1:], [[0.0, 0.6, 0.8, 0.0]]])
    q = quaternion_multiply(np.array(START) / np.linalg.norm(START), half_turns)
    out = run_fixed(FILTER, static(q, 60))
    assert apart(out, q)[-1].max() < 2e-4
    assert not bits(out)[-1].any()


def test_restart_forgets_everything() -> None:
    x = np.concatenate([static(GRID[:5], 40), static(GRID[40:45], 40)])
    x[40, 0] = -0.01
    fresh = static(GRID[40:45], 40)
    again = run_float(FILTER, x)
    first = run_float(FILTER, fresh)
    assert (bits(again)[40] & 1).all()
    for name in ("qw", "qx", "qy", "qz"):
        assert np.abs(again[name][41 + ALIGNED :] - first[name][ALIGNED:-1]).max() < 1e-9


def test_without_measurement_the_gyro_turns_on() -> None:
    """No field, or (measured) a gated force: pure integration of the rate."""
    rate = np.array([0.3, -0.2, 0.5])
    q0 = GRID[7:9]
    for gone, bit in ((MAG, 3), (ACC, 2)):
        x = static(q0, 80)
        x[40:, gone] = 0.0 if gone is MAG else 60.0
        x[40:, GYR] = rate[:, None]
        params = {"acc_max_sq": 150.0}
        for run in (run_float, run_fixed):
            out = run(FILTER, x, params)
            want = quaternion_multiply(q0, rotation_vector_to_quaternion(0.4 * rate))
            assert apart(out, want)[-1].max() < 2e-4
            assert (bits(out)[-1] >> bit & 1).all()


def test_measured_quaternion_needs_both_vectors_to_align() -> None:
    x = static(GRID[:3], 30)
    x[:20, MAG] = 0.0
    b = bits(run_float(FILTER, x))
    assert (b[:20] & 1).all() and (b[:20] & 8).all()
    assert not b[26:].any()
