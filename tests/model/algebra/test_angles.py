"""Angles, square roots, low-pass filters, remainders, the ellipsoid."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pymap3d
import pytest
from scipy import signal
from scipy.spatial.transform import Rotation

from boresight.firmware.build import CModel
from boresight.model import ops
from boresight.model.algebra.angles import (
    acos_ht,
    asin_ht,
    pitch_roll_heading_ht,
    roll_pitch_heading_ht,
    steep_angle_ht,
    unit_angle_ht,
)
from boresight.model.algebra.carried import BELOW, carried
from boresight.model.algebra.ellipsoid import EARTH, site
from boresight.model.algebra.low_pass import LowPass, filtered, gain_of
from boresight.model.algebra.square_root import WIDE, potter, whitened
from boresight.model.estimator import Estimator, Input, Output, State, input_words
from tests.support.compiled_float import numpy_float
from tests.support.rotating_array import gravity

# -- inverse trigonometry over the full range, against numpy --------------------------------------

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
    error = np.abs(fixed - floating)
    assert error.max() < 2e-9
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


@pytest.mark.parametrize(
    "ours, sequence, order, most, seed",
    [
        (roll_pitch_heading_ht, "ZYX", [2, 1, 0], [1, 0.47, 1], 1),
        (pitch_roll_heading_ht, "ZXY", [2, 0, 1], [0.47, 1, 1], 4),
    ],
)
def test_angles_of_a_matrix(
    trace: Any, ours: Any, sequence: str, order: list[int], most: list[float], seed: int
) -> None:
    """Against scipy's intrinsic sequences z-y'-x'' and z-x'-y''."""
    angles = np.random.default_rng(seed).uniform(-np.array(most), most, (300, 3))
    c = Rotation.from_euler(sequence, np.pi * angles[:, order]).as_matrix()

    def function(*elements: Any) -> Any:
        return ours([elements[:3], elements[3:6], elements[6:]])

    assert np.stack(function(*c.reshape(-1, 9).T), axis=1) == pytest.approx(angles, abs=1e-12)
    fixed, floating, saturated = trace(function, [(-1.0, 1.0)] * 9).run(*c.reshape(-1, 9).T)
    error = (np.stack(fixed) - np.stack(floating) + 1.0) % 2.0 - 1.0
    assert not saturated.any() and np.abs(error).max() < 5e-8


def test_steep_angle(trace: Any) -> None:
    angle = np.linspace(-0.4999, 0.4999, 2001)
    sine, cosine = np.sin(np.pi * angle), np.cos(np.pi * angle)
    assert np.abs(steep_angle_ht(sine, cosine, cosine < 0.7) - angle).max() < 1e-12
    traced = trace(lambda s, c: steep_angle_ht(s, c, c * c < 0.5), [(-1.0, 1.0), (0.0, 1.0)])
    (fixed,), (floating,), saturated = traced.run(sine, cosine)
    assert not saturated.any() and np.abs(fixed - floating).max() < 4e-9
    assert np.abs(fixed - angle).max() < 4e-9


# -- Potter's update against matrices of numpy ----------------------------------------------------


def test_whitened_rows_are_those_of_the_cholesky_factor() -> None:
    rng = np.random.default_rng(1)
    h, z = rng.normal(size=(3, 6)) * [[900.0], [400.0], [60.0]], rng.normal(size=3) * 500.0
    rows, white = whitened(h.tolist(), z.tolist(), 8192.0, 2.0**15)
    lower = np.linalg.cholesky(h @ h.T)
    assert np.array(rows) == pytest.approx(np.linalg.solve(lower, h), abs=1e-12)
    assert np.array(white) == pytest.approx(np.linalg.solve(lower, z), abs=1e-9)


@pytest.mark.parametrize("live", [True, False])
def test_potter_is_the_kalman_update(live: bool) -> None:
    rng = np.random.default_rng(2)
    s, x = 0.3 * rng.normal(size=(4, 4)), rng.normal(size=4)
    a, y = rng.normal(size=(2, 4)), rng.normal(size=2)
    result = potter(s, a, y - a @ x, np.bool_(live), np.bool_(False))
    p = s @ s.T
    inside = a @ p @ a.T + np.eye(2)
    gain = p @ a.T @ np.linalg.inv(inside)
    moved = x + [sum(t * w for t, w in pairs) for pairs in result.moves]
    after = np.array(result.root)
    if live:
        assert moved == pytest.approx(x + gain @ (y - a @ x), abs=1e-12)
        assert after @ after.T == pytest.approx(p - gain @ a @ p, abs=1e-12)
    else:
        assert (moved == x).all() and after == pytest.approx(s)
    # Innovations one after the other: their squares add up to those of both together.
    assert not result.wide
    if live:
        nu = y - a @ x
        assert np.dot(result.white, result.white) == pytest.approx(nu @ np.linalg.solve(inside, nu))


@pytest.mark.parametrize("size, used", [(0.7 * WIDE, True), (0.72 * WIDE, False)])
def test_a_row_that_is_too_wide_changes_nothing(size: float, used: bool) -> None:
    row, value = [[size, 0.0]], [1.0]
    result = potter(np.eye(2), row, value, np.bool_(True), np.bool_(False))
    assert result.wide == (not used)
    assert (np.array(result.root)[0, 0] < 0.5) == used
    assert (sum(t * w for t, w in result.moves[0]) != 0.0) == used
    begun = potter(0.1 * np.eye(2), row, value, np.bool_(True), np.bool_(True))
    assert np.array(begun.root) == pytest.approx(BELOW * np.eye(2), abs=1e-12)


# -- the low-pass is scipy's Butterworth behind a mean, and keeps its bits at any corner ----------

CASES = [(3.0, 1e-3), (0.5, 0.01), (0.05, 0.01), (0.05, 0.1), (0.05, 0.09), (0.04, 0.1)]


class Smooth(Estimator):
    """One channel; an input of 2 and more is no sample."""

    inputs = (Input("x", -1.0, 2.0),)
    outputs = (Output("y"),)

    def __init__(self, tau_s: float, step_s: float) -> None:
        self.low_pass = LowPass(tau_s, step_s)
        _, z, v = self.low_pass.largest
        n = self.low_pass.mean_samples
        self.states = (State("z", -z, z), State("v", -v, v), State("n", 0.0, float(n)))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        n = self.low_pass.mean_samples
        mean, hold = x.n < n - 0.5, u.x > 1.5
        weights = self.low_pass.weights(mean, ops.bounded(1.0 / (x.n + 1.0), 0.0, 1.0, "1/n"))
        sample = ops.bounded(ops.where(hold, 0.0, u.x), -1.0, 1.0, "a sample")
        (y,), ((z, v),) = filtered(weights, self.low_pass, [(x.z, x.v)], [sample], 1.0, hold)
        count = ops.where(hold, x.n, ops.minimum(x.n + 1.0, float(n)))
        return {"z": z, "v": v, "n": count}, {"y": y}


def by_scipy(low_pass: LowPass, x: Any) -> Any:
    """Mean of the first samples, then the filter in the steady state of the last mean."""
    n = low_pass.mean_samples
    mean = np.cumsum(x)[:n] / np.arange(1, n + 1)
    if low_pass.tau_s < low_pass.step_s / 2:
        return np.concatenate([mean, x[n:]])
    corner = np.sqrt(2.0) / (2.0 * np.pi * low_pass.tau_s)
    b, a = signal.butter(2, corner, fs=1.0 / low_pass.step_s)
    rest, _ = signal.lfilter(b, a, x[n:], zi=signal.lfilter_zi(b, a) * mean[-1])
    return np.concatenate([mean, rest])


def samples(low_pass: LowPass) -> Any:
    rng = np.random.default_rng(1)
    n = 3 * low_pass.mean_samples + 200
    return np.where(np.arange(n) % 7 < 3, 0.7, -0.2) + rng.uniform(-0.3, 0.3, n)


@pytest.mark.parametrize("tau_s, step_s", CASES)
def test_as_scipy_has_it(tau_s: float, step_s: float) -> None:
    made = Smooth(tau_s, step_s)
    x = samples(made.low_pass)
    y = numpy_float(made, x[:, None, None])["y"][:, 0]
    b = made.low_pass.coefficients[0]
    assert np.abs(y - by_scipy(made.low_pass, x)).max() < 1e-15 / b + 1e-14  # theirs is direct


@pytest.mark.parametrize("tau_s, step_s", [(3.0, 1e-3), (0.05, 0.09)])
def test_fixed_point_keeps_its_bits(tau_s: float, step_s: float) -> None:
    """Within 1e-6 (the corner's own word), where the direct form has 1/(4 b) LSB, here 4e-3."""
    made = Smooth(tau_s, step_s)
    program = made.compile()
    x = samples(made.low_pass)
    out, saturated = CModel(program).update(input_words(program, x[:, None, None])[:, :, 0])
    y = program.format(program.outputs[0]).real(out[:, 0])
    assert np.abs(y - by_scipy(made.low_pass, x)).max() < 1e-6
    assert not saturated.any()


@pytest.mark.parametrize("tau_s, step_s", [(0.5, 0.01), (0.05, 0.09)])
def test_the_largest_input_reaches_its_bounds_and_no_more(tau_s: float, step_s: float) -> None:
    made = Smooth(tau_s, step_s)
    corner = np.sqrt(2.0) / (2.0 * np.pi * tau_s)
    b, a = signal.butter(2, corner, fs=1.0 / step_s)
    n = 40 * made.low_pass.mean_samples
    impulse = signal.lfilter(b, a, np.eye(1, n)[0])
    worst = np.sign(impulse[::-1])
    y = numpy_float(made, np.concatenate([np.full(n, worst[0]), worst])[:, None, None])["y"]
    bound = made.low_pass.largest[0]
    assert 0.99 * bound < np.abs(y).max() <= bound
    assert bound == pytest.approx(np.abs(impulse).sum(), rel=2e-3)


def test_without_a_sample_nothing_changes() -> None:
    made = Smooth(0.05, 0.01)
    x = samples(made.low_pass)
    sparse = np.full(3 * len(x), 2.0)
    sparse[::3] = x
    y = numpy_float(made, sparse[:, None, None])["y"][::3, 0]
    assert np.abs(y - by_scipy(made.low_pass, x)).max() < 1e-12


def test_first_order_gain() -> None:
    assert gain_of(9.0, 0.01) == pytest.approx(1.0 - np.exp(-0.01 / 9.0), rel=1e-12)


# -- sums in two words: nothing is lost to rounding, on the C too; where they begin ---------------


class Sum(Estimator):
    """Sums of products, in two words and in one."""

    inputs = (
        Input("a", -1.0, 1.0),
        Input("b", -1.0, 1.0),
        Input("new", 0.0, 1.0),
        Input("c", -1.0, 1.0),
    )
    states = (
        State("high", -8.0, 8.0 * BELOW),
        State("low", -(2.0**-12), 2.0**-12 * BELOW),
        State("plain", -8.0, 8.0 * BELOW),
    )
    outputs = (Output("high"), Output("low"), Output("plain"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        high, low = carried(x.high, x.low, [(u.a, u.b)], 8.0, u.new > 0.5)
        plain = ops.saturated(x.plain + u.c * u.b, 8.0)  # a product of three uses is a word
        after = {"high": high, "low": low, "plain": plain}
        return after, after


def test_a_carried_sum_keeps_what_one_word_rounds_away() -> None:
    n = 4000
    rng = np.random.default_rng(3)
    u = np.zeros((n, 4, 1))
    u[:, :2, 0] = 1e-4 * rng.normal(size=(n, 2)) + 2e-5
    u[:, 3] = u[:, 0]
    program = Sum().compile()
    words = input_words(program, u)[:, :, 0]
    seen = [program.format(k).real(words[:, j]) for j, k in enumerate(program.inputs)]
    out, saturated = CModel(program).update(words)
    high, low, plain = (program.format(k).real(out[:, j]) for j, k in enumerate(program.outputs))
    exact = np.cumsum(seen[0] * seen[1])
    assert np.abs(high + low - exact).max() < 1e-11 < 1e-8 < np.abs(plain - exact).max()
    assert not saturated.any()
    x = SimpleNamespace(high=1.0, low=1e-5, plain=0.0)
    after, _ = Sum().step(x, SimpleNamespace(a=0.5, b=0.5, c=0.5, new=1.0), None)
    assert after["high"] == 0.0 == after["low"]


def test_begins_where_it_is_told_and_goes_on_from_there() -> None:
    for begin, first in ((True, 0.3), (False, 0.75 + 1e-9)):
        high, low = carried(0.25, 1e-9, [0.25, (0.5, 0.5)], 1.0, begin, 0.3, [1e-7, (0.1, 0.1)])
        assert high + low == pytest.approx(first + 1e-7 + 0.01, abs=1e-15)
    high, low = carried(1.0 - 2.0**-31, 0.0, [1e-9], 1.0, False)
    assert high <= 1.0 and abs(low) <= 2.0**-15


# -- `site` against the closed formulas and another package, up to 89 deg and 10 km ---------------

PLACES = [(31.9521, 45.0), (-89.0, 0.0), (89.0, 10e3), (0.0, 10e3), (45.0, -400.0), (-33.0, 3e3)]


@pytest.mark.parametrize("latitude, height", PLACES)
def test_a_site(latitude: float, height: float) -> None:
    dt = 0.01
    result = site(latitude / 180.0, height, dt)
    sine, cosine = np.sin(np.radians(latitude)), np.cos(np.radians(latitude))
    assert np.array(result.earth) / dt == pytest.approx([EARTH * cosine, EARTH * sine], rel=1e-12)
    assert result.gravity / dt == pytest.approx(gravity(latitude, height), abs=2e-8)
    along = 1.0 / (pymap3d.rcurve.meridian(latitude) + height)
    across = 1.0 / (pymap3d.rcurve.transverse(latitude) + height)
    assert np.array(result.curvature) / dt == pytest.approx(
        [along, across, across * sine / cosine], rel=4e-6
    )
