"""Calibration and spectra."""

import numpy as np
import pytest
from scipy.linalg import polar, sqrtm
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.attitude.ma2014.calibration import (
    nearest_rotation,
    orthogonality_error,
    triad_matrix,
)
from boresight.sim.attitude.ma2014.spectrum import line_amplitude, share, spectrum

# -- mean triad matrix and polar orthogonalisation, against scipy ---------------------------------

MOUNTING = Rotation.from_euler("xyz", (3.0, -5.0, 8.0), degrees=True).as_matrix()


def test_triad_matrix_undoes_the_platform_axes_and_averages():
    rng = np.random.default_rng(1)
    b = np.eye(3) + 0.2 * rng.standard_normal((3, 3))
    sights = np.stack([MOUNTING @ b] * 10)
    np.testing.assert_allclose(triad_matrix(sights, b), MOUNTING, atol=1e-14)
    noise = 0.01 * rng.standard_normal((10, 3, 3))
    np.testing.assert_allclose(
        triad_matrix(sights + noise, b),
        MOUNTING + noise.mean(axis=0) @ np.linalg.inv(b),
        atol=1e-14,
    )


@pytest.mark.parametrize("seed", range(20))
def test_polar_factor_is_scipys_and_the_papers_formula(seed):
    t = MOUNTING + 0.1 * np.random.default_rng(seed).standard_normal((3, 3))
    t_0 = nearest_rotation(t)
    np.testing.assert_allclose(t_0, polar(t)[0], atol=1e-13)
    np.testing.assert_allclose(t_0, t @ np.linalg.inv(np.real(sqrtm(t.T @ t))), atol=1e-12)
    assert orthogonality_error(t_0) < 1e-14
    assert np.linalg.det(t_0) == pytest.approx(1.0)


def test_orthogonality_error_is_the_largest_element():
    assert orthogonality_error(np.diag([1.0, 1.1, 0.9])) == pytest.approx(0.21)
    assert orthogonality_error(MOUNTING) < 1e-15


def test_mean_of_ten_is_nearer_than_one():
    rng = np.random.default_rng(2)
    errors = {1: [], 10: []}
    for _ in range(50):
        sights = MOUNTING + 0.01 * rng.standard_normal((10, 3, 3))
        for n, value in errors.items():
            turn = nearest_rotation(triad_matrix(sights[:n], np.eye(3))) @ MOUNTING.T
            value.append(Rotation.from_matrix(turn).magnitude())
    assert 2.5 < np.mean(errors[1]) / np.mean(errors[10]) < 4.0  # sqrt(10)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: triad_matrix(np.eye(3), np.eye(3)), r"s and b must have the shapes .*"),
        (lambda: triad_matrix(np.zeros((0, 3, 3)), np.eye(3)), r"s and b must have the shapes .*"),
        (lambda: triad_matrix(np.full((1, 3, 3), np.nan), np.eye(3)), "s and b must be finite"),
        (
            lambda: triad_matrix(np.zeros((1, 3, 3)), np.ones((3, 3))),
            "the axes in b must not lie in one plane",
        ),
        (lambda: nearest_rotation(np.zeros((3, 3))), r"T must have a determinant above 0: .*"),
        (lambda: nearest_rotation(np.diag([1.0, 1.0, -1.0])), r".*\(determinant -1\)"),
        (lambda: nearest_rotation(np.eye(2)), r"T must be a finite matrix .*"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InputError, match=f"^{message}$"):
        call()


# -- spectra of known signals ---------------------------------------------------------------------

RATE = 8.0
T = np.arange(480) / RATE  # 60 s


@pytest.mark.parametrize("count", [480, 479])
def test_a_sine_of_whole_periods_is_one_line_of_its_amplitude(count):
    f = 30 * RATE / count
    s = spectrum(3.0 + 0.7 * np.sin(2 * np.pi * f * T[:count] + 0.3), RATE)
    k = int(np.argmax(s.amplitude))
    assert s.frequency[k] == pytest.approx(f) and s.amplitude[k] == pytest.approx(0.7)
    assert np.delete(s.amplitude, k).max() < 1e-12  # the mean is gone too
    assert line_amplitude(s, f + 0.4 * RATE / count) == pytest.approx(0.7)


def test_energy_is_the_variance():
    x = np.random.default_rng(1).standard_normal(479)
    s = spectrum(x, RATE)
    assert np.square(s.amplitude).sum() / 2 == pytest.approx(x.var())


def test_share_counts_from_low_up_to_but_without_high():
    x = 2.0 * np.sin(2 * np.pi * 0.5 * T) + 1.0 * np.sin(2 * np.pi * 1.0 * T)
    s = spectrum(x, RATE)
    assert share(s, 0.0, 0.75) == pytest.approx(0.8)
    assert share(s, 0.5, 1.0) == pytest.approx(0.8)
    assert share(s, 0.0, 4.0) == pytest.approx(1.0)


def test_columns_are_signals_of_their_own():
    x = np.stack([np.sin(2 * np.pi * 0.5 * T), 3 * np.sin(2 * np.pi * 0.5 * T)], axis=1)
    np.testing.assert_allclose(line_amplitude(spectrum(x, RATE), 0.5), (1.0, 3.0))


@pytest.mark.parametrize("bad", [[1.0, 2.0, 3.0], [1.0, np.nan, 2.0, 3.0, 4.0]])
def test_bad_signals(bad):
    with pytest.raises(InputError, match="^signal must have 4 finite samples or more"):
        spectrum(bad, RATE)
