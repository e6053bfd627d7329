"""Update and prediction of P against the matrix form in numpy."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude.mekf.covariance import (
    GROWTH_LIMIT,
    P0_HEADING,
    P0_TILT,
    TRACE_LIMIT,
    predicted,
)
from boresight.model.attitude.mekf.interface import BIAS_SCALE

PARAMS = SimpleNamespace(bias_var=2e-7, rest_var=3e-6, p0_bias=1e-4)
STEP, WALK, GROWTH = 0.02, 0.01, 0.03
C = Rotation.from_euler("ZXY", [0.4, -0.3, 1.1]).as_matrix()


def drawn(size: float) -> np.ndarray:
    a = np.random.default_rng(3).standard_normal((6, 6))
    p = a @ a.T
    return p * (size / np.trace(p))


def found(p: np.ndarray, gain: np.ndarray, column: np.ndarray, **more: object) -> np.ndarray:
    options = {"step": STEP, "starts": (False, False), "keep": 1.0, "rest_gain": 0.0, **more}
    options.setdefault("growth", GROWTH)
    return np.array(
        predicted(p.tolist(), gain, column, C.tolist(), attitude=WALK, p=PARAMS, **options)
    )


def wanted(p: np.ndarray, step: float, rest_gain: float) -> np.ndarray:
    a = C * step / BIAS_SCALE
    phi = np.block([[np.eye(3), -a], [np.zeros((3, 3)), np.eye(3)]])
    added = [step * (WALK + GROWTH)] * 3
    bias = BIAS_SCALE**2 * (PARAMS.bias_var * step + PARAMS.rest_var * rest_gain)
    after = phi @ (p + np.diag([0.0] * 3 + [bias] * 3)) @ phi.T + np.diag([*added, *[0.0] * 3])
    # More than the exact product, as the code says.
    after[:3, :3] += a @ (p[3:, 3:] + bias * np.eye(3)) @ a.T
    return after


def test_is_the_matrix_form() -> None:
    p, h = drawn(1.0), 1
    column = p[h]
    gain = column / (p[h, h] + 0.3)
    updated = p - np.outer(gain, column)
    assert found(p, gain, column) == pytest.approx(wanted(updated, STEP, 0.0), abs=1e-14)


def test_rest_shrinks_the_bias() -> None:
    p, k = drawn(1.0), 0.2
    d = np.diag([1.0] * 3 + [1.0 - k] * 3)
    after = found(p, np.zeros(6), np.zeros(6), keep=1.0 - k, rest_gain=k)
    assert after == pytest.approx(wanted(d @ p @ d, STEP, k), abs=1e-14)


def test_a_large_trace_does_not_grow() -> None:
    none = np.zeros(6)
    assert found(drawn(1.01 * TRACE_LIMIT), none, none) == pytest.approx(drawn(1.01 * TRACE_LIMIT))
    assert np.trace(found(drawn(0.99 * TRACE_LIMIT), none, none)) > 0.99 * TRACE_LIMIT


def test_growth_of_one_step_is_limited() -> None:
    p, none = drawn(0.1), np.zeros(6)
    after = found(p, none, none, growth=1e3)
    a = C * STEP / BIAS_SCALE
    rest = wanted(p, STEP, 0.0)[0, 0] - STEP * (WALK + GROWTH)
    assert after[0, 0] == pytest.approx(rest + GROWTH_LIMIT) and np.abs(a).max() < 1.0


def test_p0() -> None:
    after = found(drawn(1.0), np.ones(6), np.ones(6), starts=(True, True))
    bias = BIAS_SCALE**2 * PARAMS.p0_bias
    assert after == pytest.approx(np.diag([P0_TILT, P0_TILT, P0_HEADING, bias, bias, bias]))


def test_the_bias_stays_known_where_the_attitude_begins_anew() -> None:
    p, none = drawn(1.0), np.zeros(6)
    after = found(p, none, none, starts=(True, False))
    assert after[:3, :3] == pytest.approx(np.diag([P0_TILT, P0_TILT, P0_HEADING]))
    assert not after[:3, 3:].any()
    assert after[3:, 3:] == pytest.approx(wanted(p, STEP, 0.0)[3:, 3:])
