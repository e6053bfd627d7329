"""The paper's complementary filter against its equations, written once more in numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude.ma2014 import Ma2014Cf
from boresight.sim.attitude.ma2014.world import E2, FIELD_UT, make_log
from boresight.sim.records.feed import feed
from tests.support.exact_sensors import ACC, GYR, MAG, at_rest, run_fixed, run_float

FILTER = Ma2014Cf()
KP, KI = np.array((0.1414, 0.1414, 0.1)), np.array((5e-7, 5e-5, 5e-7))
SITE = {"field_east": -3.45, "field_north": 27.9}
FIELD = (-3.45, 27.9, -46.2)
FULL = {f"kp_{n}": 1.0 for n in ("pitch", "roll", "heading")}
NONE = {f"k{k}_{n}": 0.0 for k in "pi" for n in ("pitch", "roll", "heading")}


def angles(outputs: Any) -> Any:
    """Pitch, roll, heading in radians (steps, ..., 3)."""
    return np.pi * np.stack([outputs[n] for n in ("pitch", "roll", "heading")], axis=-1)


def wrapped(x: Any) -> Any:
    return (x + np.pi) % (2.0 * np.pi) - np.pi


def textbook(x: Any) -> Any:
    """Equations (3) to (7) and (13) of records (steps, 10), in radians."""
    out, integral, state = [], np.zeros(3), np.zeros(3)

    def rates(a: Any, w: Any) -> Any:
        return np.linalg.solve(  # of Rz Rx Ry: w = Ry^T (Rx^T (0, 0, psi') + (theta', 0, 0)) + ...
            [
                [np.cos(a[1]), 0.0, -np.cos(a[0]) * np.sin(a[1])],
                [0.0, 1.0, np.sin(a[0])],
                [np.sin(a[1]), 0.0, np.cos(a[0]) * np.cos(a[1])],
            ],
            w,
        )

    for k, row in enumerate(x):
        f, w, m, dt = row[ACC] / np.linalg.norm(row[ACC]), row[GYR], row[MAG], row[0]
        theta, gamma = np.arcsin(f[1]), np.arctan2(-f[0], f[2])
        h = Rotation.from_euler("XY", [theta, gamma]).apply(m)
        psi = np.arctan2(FIELD_UT[1], FIELD_UT[0]) - np.arctan2(h[1], h[0])
        seen = np.array([theta, gamma, psi])
        ahead = state + dt * rates(state + 0.5 * dt * rates(state, w), w)
        e = wrapped(ahead - seen)
        integral = integral + KI * e if k else integral
        state = wrapped(ahead - KP * e - integral if k else seen)
        out.append(state)
    return np.array(out)


def test_it_is_the_equations_of_the_paper() -> None:
    x = feed(FILTER, make_log(E2, "C", 3)).inputs
    got = angles(run_float(FILTER, x[:, :, None]))[:, 0]
    assert np.abs(wrapped(got - textbook(x))).max() < 1e-12


@pytest.mark.parametrize("run, worst", [(run_float, 1e-12), (run_fixed, 2e-7)])
def test_with_full_gains_it_inverts_the_measurement(run: Any, worst: float) -> None:
    euler = np.random.default_rng(7).uniform((-1.4, -3.1, -3.1), (1.4, 3.1, 3.1), (200, 3))
    q = Rotation.from_euler("ZXY", euler[:, [2, 0, 1]]).as_quat(scalar_first=True)
    x = at_rest(q, 3, 0.01, FIELD)
    got = angles(run(FILTER, x, {**NONE, **FULL, **SITE}))
    assert np.abs(wrapped(got - euler)).max() < worst


@pytest.mark.parametrize(
    "as_printed, sequence, order", [(False, "ZXY", (1, 2, 0)), (True, "ZYX", (2, 1, 0))]
)
def test_each_set_of_rates_belongs_to_its_sequence(
    as_printed: bool, sequence: str, order: Any
) -> None:
    """From the attitude of the first sample, by the gyro alone."""
    rng, dt = np.random.default_rng(2), 1e-4
    euler, w = rng.uniform(-1.2, 1.2, (50, 3)), rng.uniform(-1.0, 1.0, (50, 3))
    q = Rotation.from_euler("ZXY", euler[:, [2, 0, 1]]).as_quat(scalar_first=True)
    x = at_rest(q, 2, dt, FIELD)
    x[1, GYR] = w.T
    got = angles(run_float(Ma2014Cf(as_printed=as_printed), x, {**NONE, **SITE}))
    np.testing.assert_allclose(got[0], euler, atol=1e-12)
    before = np.empty_like(euler)
    before[:, list(order)] = euler
    turned = Rotation.from_euler(sequence, before) * Rotation.from_rotvec(w * dt)
    change = (turned.as_euler(sequence) - before)[:, list(order)]
    np.testing.assert_allclose(wrapped(got[1] - euler), change, atol=1e-7)


def test_it_begins_with_the_first_field_and_anew_with_a_negative_step() -> None:
    q = Rotation.from_euler("ZXY", [[0.5, 0.2, -0.3], [-2.0, -0.4, 1.0]]).as_quat(scalar_first=True)
    x = at_rest(q[:1], 30, 0.01, FIELD)
    x[:10, MAG] = 0.0
    x[20:] = at_rest(q[1:], 10, 0.01, FIELD)
    x[20, 0] = -0.01
    got = angles(run_fixed(FILTER, x, SITE))[:, 0]
    np.testing.assert_allclose(got[:10, :2], [[0.2, -0.3]] * 10, atol=1e-7)
    np.testing.assert_allclose(got[10:20], [[0.2, -0.3, 0.5]] * 10, atol=1e-7)
    np.testing.assert_allclose(got[20:], [[-0.4, 1.0, -2.0]] * 10, atol=1e-7)


def test_a_sample_without_a_field_leaves_the_heading_to_the_gyro() -> None:
    x = at_rest(np.array([[1.0, 0.0, 0.0, 0.0]]), 50, 0.01, FIELD)
    x[1:, GYR.stop - 1] = 0.2
    x[1:, MAG] = 0.0
    heading = angles(run_float(FILTER, x, SITE))[:, 0, 2]
    np.testing.assert_allclose(np.diff(heading), 0.002, atol=1e-12)


def test_the_integral_takes_a_bias_away() -> None:
    """A bias b leaves a residual of b / Kp, and that decays with Kp / Ki samples."""
    x, step = at_rest(np.array([[1.0, 0.0, 0.0, 0.0]]), 40_000, 0.01, FIELD), 0.01 * 0.01
    x[:, GYR.start + 1] = 0.01
    residual = angles(run_fixed(FILTER, x, SITE))[:, 0, 1] + step
    assert residual[50] == pytest.approx(step / KP[1], rel=0.02)
    decay = np.log(residual[1_000] / residual[5_000])
    assert decay == pytest.approx(4_000 * KI[1] / KP[1], rel=0.01)
    assert abs(residual[-1]) < 1e-3 * residual[50]
