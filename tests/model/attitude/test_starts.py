"""Every attitude filter starts right in any position, in fixed point as in float64."""

from __future__ import annotations

from functools import cache
from itertools import permutations, product
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of
from boresight.sim.rotations.accuracy import attitude_of
from tests.support.exact_sensors import ACC, MAG, apart, at_rest, bits, run_fixed, run_float

#: Filters, and the largest angle between fixed point and float64 from the first row on, in degrees,
#: by word width, of sensors without noise.
FILTERS = {
    "mekf": {32: 0.001, 24: 0.01, 18: 0.2},
    "ekf_quaternion": {32: 0.002, 24: 0.2, 18: 8.0},
    "ekf_bias": {32: 0.001, 24: 0.1, 20: 2.5},
    "vqf(rate_hz=100)": {32: 0.0005, 24: 0.1, 18: 0.3},
    "complementary": {32: 0.0005, 24: 0.005, 18: 0.2},
}
FIELD = (0.0, 20.0, -40.0)
filter_of = cache(estimator_of)


@cache
def orientations() -> Any:
    """The 24 of a cube, and 100 at random, as w, x, y, z."""
    cube = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    turns = [Rotation.from_matrix(m).as_quat() for m in cube if np.linalg.det(m) > 0.0]
    q = np.concatenate([turns, Rotation.random(100, random_state=1).as_quat()])
    return q[:, [3, 0, 1, 2]]


def skipped(name: str) -> int:
    """Rows before the first one that counts: `complementary` finds its attitude in three."""
    return 3 if name == "complementary" else 0


EXACT = [(name, word) for name, widths in FILTERS.items() for word in widths]


@pytest.mark.parametrize(("name", "word"), EXACT)
def test_a_start_in_any_position(name: str, word: int) -> None:
    estimator, x = filter_of(name), at_rest(orientations(), 8, 0.01, FIELD)
    error = apart(run_fixed(estimator, x, None, word), attitude_of(run_float(estimator, x)))
    assert error[skipped(name) :].max() < FILTERS[name][word]


CASES = [(name, word) for name in FILTERS for word in filter_of(name).start_deg]


@cache
def starts() -> list[Any]:
    """At rest in two fields, exact and with the noise of sensors."""
    rng, found = np.random.default_rng(5), []
    for field in (FIELD, (3.0, 11.0, -43.0)):
        x = at_rest(orientations(), 8, 0.01, field)
        noisy = x.copy()
        noisy[:, ACC] += 0.03 * rng.normal(size=x[:, ACC].shape)
        noisy[:, MAG] += 0.3 * rng.normal(size=x[:, MAG].shape)
        found += [x, noisy]
    return found


@pytest.mark.parametrize(("name", "word"), CASES)
def test_a_start_is_as_fine_as_stated(name: str, word: int) -> None:
    """With and without noise, within what the filter says of its word."""
    estimator, first, errors = filter_of(name), skipped(name), []
    for y in starts():
        out = run_fixed(estimator, y, None, word)
        error = apart(out, attitude_of(run_float(estimator, y)))[first:]
        is_steep = bits(out)[first:] & 0b1000000 != 0
        aligning = bits(out)[first:] & 0b01 != 0
        judged = {"complementary": ~is_steep, "ekf_quaternion": ~aligning}.get(name, error >= 0)
        errors.append(error[judged])
        assert name != "complementary" or error.max() < 1.5
    bound = estimator.start_deg[word]
    assert 0.1 * bound < max(e.max() for e in errors) < bound
    assert (f"{bound:g} deg" in estimator.start_note(word)) == (bound > 0.02)


@pytest.mark.parametrize(("word", "bound"), [(18, 8.0), (22, 0.4), (25, 0.05), (26, 0.02)])
def test_rows_that_are_not_aligned_yet_are_near_float64(word: int, bound: float) -> None:
    estimator = filter_of("ekf_quaternion")
    for y in starts():
        out = run_fixed(estimator, y, None, word)
        assert apart(out, attitude_of(run_float(estimator, y))).max() < bound


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_dead_accelerometer_or_a_vertical_field_is_no_attitude(name: str, noise: float) -> None:
    """Bit 0 of the status says so, or 1 of the heading; with the noise of sensors, too."""
    estimator, rng = filter_of(name), np.random.default_rng(0)
    x, vertical = (
        at_rest(orientations()[::25], 300, 0.01, field) for field in (FIELD, (0.1, 0.1, -45.0))
    )
    for each in (x, vertical):
        each[:, MAG] += 0.5 * noise * rng.normal(size=each[:, MAG].shape)
    dead = x.copy()
    dead[:, ACC] = 0.1 * noise * rng.normal(size=dead[:, ACC].shape)
    heading = 0b01 if name == "ekf_quaternion" else 0b10  # it has no attitude without a heading
    for records, bit in ((dead, 0b01), (vertical, heading)):
        assert (bits(run_fixed(estimator, records))[3:] & bit).all()
    assert not (bits(run_fixed(estimator, x))[-1] & 0b11).any()


def test_a_word_that_is_too_short_for_a_filter_is_refused() -> None:
    with pytest.raises(
        InputError, match="estimator ekf_bias: wanted a word of 20 bits or more, found 18"
    ):
        filter_of("ekf_bias").compile(word=18)
