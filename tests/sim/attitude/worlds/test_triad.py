"""Every error of a sensor on its own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from boresight.sim.attitude.worlds import Triad, misalignment

T = np.arange(4000) / 100.0
PLAIN = Triad(0.0, 10.0)


WAVES = np.stack([np.sin(T), np.cos(2 * T), 0.5 * np.sin(3 * T)], axis=1)


def rng():
    return np.random.default_rng(5)


def test_an_ideal_sensor_tells_the_truth():
    np.testing.assert_array_equal(PLAIN.read(WAVES, rng()), WAVES)


def test_words_are_whole_counts_within_half_a_count_of_the_truth():
    out = Triad(0.125, 10.0).read(WAVES, rng())
    np.testing.assert_array_equal(out / 0.125, np.rint(out / 0.125))
    assert 0.0624 < np.abs(out - WAVES).max() <= 0.0625


def test_full_scale_limits_both_signs():
    out = Triad(0.0, 0.4).read(WAVES, rng())
    assert out.max() == 0.4 and out.min() == -0.4
    np.testing.assert_array_equal(out, np.clip(WAVES, -0.4, 0.4))


def test_noise_has_the_variance_of_each_axis_and_averaging_divides_it():
    triad = Triad(0.0, 10.0, variance=(0.01, 0.04, 0.0))
    noise = triad.read(WAVES, rng()) - WAVES
    np.testing.assert_allclose(noise.var(axis=0), (0.01, 0.04, 0.0), rtol=0.08)
    assert abs(np.corrcoef(noise[:-1, 0], noise[1:, 0])[0, 1]) < 0.05  # white
    averaged = replace(triad, averaged=4.0).read(WAVES, rng()) - WAVES
    np.testing.assert_allclose(averaged, noise / 2.0, atol=1e-12)
    fine = Triad(0.1, 10.0, averaged=4.0).read(WAVES, rng())
    np.testing.assert_allclose(fine / 0.025, np.rint(fine / 0.025), atol=1e-9)
    assert np.abs(fine - WAVES).max() <= 0.0125 + 1e-12


def test_misalignment_is_a_rotation_of_the_size_asked_for():
    draws = [misalignment(np.random.default_rng(k), math.radians(1.0)) for k in range(400)]
    turns = np.degrees([Rotation.from_matrix(m).as_rotvec() for m in draws])
    np.testing.assert_allclose(turns.std(axis=0), 1.0, rtol=0.12)
    np.testing.assert_allclose(draws[0].T @ draws[0], np.eye(3), atol=1e-14)
    np.testing.assert_array_equal(misalignment(rng(), 0.0), np.eye(3))
