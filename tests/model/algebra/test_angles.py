"""Inverse trigonometry over the full range, against numpy."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model import ops
from boresight.model.algebra.angles import (
    acos_ht,
    asin_ht,
    pitch_roll_heading_ht,
    roll_pitch_heading_ht,
    steep_angle_ht,
    unit_angle_ht,
)

EDGES = np.array([-1.0, -0.999999, -0.75, -0.5, -1e-9, 0.0, 1e-9, 0.5, 0.71, 0.999999, 1.0])
SINES = np.concatenate([EDGES, np.linspace(-1.0, 1.0, 4001), 1.0 - np.logspace(-9, -1, 200)])


@pytest.mark.parametrize(
    "ours, theirs", [(asin_ht, np.arcsin), (acos_ht, np.arccos)], ids=["asin", "acos"]
)
def test_full_range(trace: Any, ours: Any, theirs: Any) -> None:
    """Float64 within rounding; the word within a few LSB, at the ends too."""
    traced = trace(ours, [(-1.0, 1.0)])
    (fixed,), (floating,), saturated = traced.run(SINES)
    exact = theirs(np.clip(SINES, -1.0, 1.0)) / np.pi
    assert not saturated.any()
    assert np.abs(ours(SINES) - exact).max() < 3e-9
    apart = np.abs(fixed - floating)
    assert apart.max() < 2e-9
    value = traced.program.values[traced.program.outputs[0]]
    assert (value.low, value.high) == ((0.0, 1.0) if ours is acos_ht else (-0.5, 0.5))


def test_beyond_the_range_the_nearer_end(trace: Any) -> None:
    wide = np.array([-3.0, -1.5, 1.0001, 2.0])
    traced = trace(lambda x: (asin_ht(x), acos_ht(x)), [(-4.0, 4.0)])
    (arc_sine, arc_cosine), _, saturated = traced.run(wide)
    assert arc_sine == pytest.approx([-0.5, -0.5, 0.5, 0.5], abs=1e-9)
    assert arc_cosine == pytest.approx([1.0, 1.0, 0.0, 0.0], abs=1e-9)
    assert not saturated.any()
    assert asin_ht(wide).tolist() == [-0.5, -0.5, 0.5, 0.5]


def test_known_length(trace: Any) -> None:
    angle = np.linspace(-0.9999, 0.9999, 2001)
    x, y = 0.8 * np.cos(np.pi * angle), 0.8 * np.sin(np.pi * angle)
    assert np.abs(unit_angle_ht(y, x, 1.25) - angle).max() < 1e-12
    traced = trace(
        lambda y, x: unit_angle_ht(y, x, ops.rsqrt(x * x + y * y)), [(-1.0, 1.0), (-1.0, 1.0)]
    )
    (fixed,), (floating,), saturated = traced.run(y, x)
    assert not saturated.any() and np.abs(fixed - floating).max() < 4e-9


def test_roll_pitch_heading(trace: Any) -> None:
    """Against scipy's intrinsic sequence z-y'-x''."""
    angles = np.random.default_rng(1).uniform([-1, -0.47, -1], [1, 0.47, 1], (300, 3))
    c = Rotation.from_euler("ZYX", np.pi * angles[:, ::-1]).as_matrix()

    def function(*elements: Any) -> Any:
        return roll_pitch_heading_ht([elements[:3], elements[3:6], elements[6:]])

    assert np.stack(function(*c.reshape(-1, 9).T), axis=1) == pytest.approx(angles, abs=1e-12)
    fixed, floating, saturated = trace(function, [(-1.0, 1.0)] * 9).run(*c.reshape(-1, 9).T)
    apart = (np.stack(fixed) - np.stack(floating) + 1.0) % 2.0 - 1.0
    assert not saturated.any() and np.abs(apart).max() < 5e-8


def test_pitch_roll_heading(trace: Any) -> None:
    """Against scipy's intrinsic sequence z-x'-y''."""
    angles = np.random.default_rng(4).uniform([-0.47, -1, -1], [0.47, 1, 1], (300, 3))
    c = Rotation.from_euler("ZXY", np.pi * angles[:, [2, 0, 1]]).as_matrix()

    def function(*elements: Any) -> Any:
        return pitch_roll_heading_ht([elements[:3], elements[3:6], elements[6:]])

    assert np.stack(function(*c.reshape(-1, 9).T), axis=1) == pytest.approx(angles, abs=1e-12)
    fixed, floating, saturated = trace(function, [(-1.0, 1.0)] * 9).run(*c.reshape(-1, 9).T)
    apart = (np.stack(fixed) - np.stack(floating) + 1.0) % 2.0 - 1.0
    assert not saturated.any() and np.abs(apart).max() < 5e-8


def test_roll_pitch_heading_of_a_scaled_matrix(trace: Any) -> None:
    rng = np.random.default_rng(9)
    angles = rng.uniform([-np.pi, -1.4, -np.pi], [np.pi, 1.4, np.pi], (400, 3))
    c = Rotation.from_euler("ZYX", angles).as_matrix()
    factor = rng.uniform(0.5, 3.9, 400)

    def step(a: Any, *v: Any) -> Any:
        rows = [v[:3], v[3:6], v[6:]]
        return roll_pitch_heading_ht(rows, a)

    t = trace(step, [(0.25, 2.0), *[(-4.0, 4.0)] * 9], 32)
    given = (factor[:, None, None] * c).reshape(400, 9)
    fixed, floats, _ = t.run(1.0 / factor, *given.T)
    for y, real, wanted in zip(fixed, floats, angles[:, ::-1].T / np.pi, strict=True):
        assert np.abs((real - wanted + 1.0) % 2.0 - 1.0).max() < 1e-8
        assert np.abs((y - real + 1.0) % 2.0 - 1.0).max() < 2e-6


def test_steep_angle(trace: Any) -> None:
    angle = np.linspace(-0.4999, 0.4999, 2001)
    sine, cosine = np.sin(np.pi * angle), np.cos(np.pi * angle)
    assert np.abs(steep_angle_ht(sine, cosine, cosine < 0.7) - angle).max() < 1e-12
    traced = trace(lambda s, c: steep_angle_ht(s, c, c * c < 0.5), [(-1.0, 1.0), (0.0, 1.0)])
    (fixed,), (floating,), saturated = traced.run(sine, cosine)
    assert not saturated.any() and np.abs(fixed - floating).max() < 4e-9
    assert np.abs(fixed - angle).max() < 4e-9
