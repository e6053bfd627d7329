"""Every attitude filter starts right in any position, in fixed point as in float64."""

from __future__ import annotations

from itertools import permutations, product
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of
from boresight.sim.rotations.outputs import attitude_of
from tests.support.exact_sensors import ACC, MAG, apart, at_rest, bits, run_fixed, run_float

FILTERS = ("mekf", "ekf_quaternion", "ekf_bias", "vqf(rate_hz=100)", "complementary")
FIELD = (0.0, 20.0, -40.0)


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


CASES = [(name, word) for name in FILTERS for word in estimator_of(name).start_deg]


@pytest.mark.parametrize(("name", "word"), CASES)
def test_a_start_in_any_position(name: str, word: int) -> None:
    """With and without noise, within what the filter says of its word."""
    estimator, q = estimator_of(name), orientations()
    rng, x = np.random.default_rng(5), at_rest(q, 8, 0.01, FIELD)
    noisy = x.copy()
    noisy[:, ACC] += 0.03 * rng.normal(size=x[:, ACC].shape)
    noisy[:, MAG] += 0.3 * rng.normal(size=x[:, MAG].shape)
    skipped = 3 if name == "complementary" else 0  # it finds its attitude in three samples
    errors = []
    for y in (x, noisy):
        out = run_fixed(estimator, y, None, word)
        error = apart(out, attitude_of(run_float(estimator, y)))
        is_steep = (bits(out) & 0b1000000 != 0) & (name == "complementary")
        errors.append(error[skipped:][~is_steep[skipped:]])
        assert not is_steep.any() or error[skipped:].max() < 1.5
    bound = estimator.start_deg[word]
    assert 0.1 * bound < max(e.max() for e in errors) < bound
    assert (f"{bound:g} deg" in estimator.start_note(word)) == (bound > 0.02)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_dead_accelerometer_or_a_vertical_field_is_no_attitude(name: str, noise: float) -> None:
    """Bit 0 of the status says so, or 1 of the heading; with the noise of sensors, too."""
    estimator, rng = estimator_of(name), np.random.default_rng(0)
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
        estimator_of("ekf_bias").compile(word=18)
