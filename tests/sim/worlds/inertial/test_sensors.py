"""Errors of triads that report increments."""

import math

import numpy as np
import pytest

from boresight.sim.worlds.inertial.sensors import (
    ACCELEROMETER,
    FIBRE_OPTIC,
    MICRO_G,
    PER_HOUR,
    Noise,
    Triad,
    signed,
)

DT, EXACT = 0.01, Noise()


def triad(noise: Noise = EXACT, seed: int = 1) -> Triad:
    bias, matrix = signed(None, 3e-3, 1e-2, 2e-2)
    return Triad(bias, matrix, noise, (seed, 2), DT)


def test_constant_errors() -> None:
    """All plus: scale on the diagonal, the others askew."""
    true = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    wanted = [[1.01, 0.02, 0.02], [0.04, 2.02, 0.04]]
    np.testing.assert_allclose(triad().read(true), np.array(wanted) + 3e-5, rtol=1e-12)


def test_signs() -> None:
    """Sizes stay; over many draws each sign comes as often as the other, by itself."""
    draws = [signed(np.random.default_rng(k), 3.0, 0.1, 0.2) for k in range(400)]
    bias, matrix = (np.array(part) for part in zip(*draws, strict=True))
    assert set(np.abs(bias).ravel()) == {3.0}
    size = np.where(np.eye(3), 0.1, 0.2)
    np.testing.assert_allclose(np.abs(matrix - np.eye(3)), np.broadcast_to(size, matrix.shape))
    signs = np.sign(np.concatenate([bias[:, :, None], matrix - np.eye(3)], axis=2)).reshape(400, 12)
    together = signs.T @ signs / 400.0
    assert np.abs(signs.mean(axis=0)).max() < 0.2
    assert np.abs(together - np.eye(12)).max() < 0.2


def test_white_noise_walks_as_declared() -> None:
    """Variance of the integral: density^2 times time; axes by themselves."""
    found = triad(Noise(white=0.5)).read(np.zeros((40_000, 3))) - 3e-5
    np.testing.assert_allclose(found.var(axis=0), 0.5**2 * DT, rtol=0.04)
    assert np.abs(np.corrcoef(found.T) - np.eye(3)).max() < 0.02


def test_bias_walks_as_declared() -> None:
    """Variance of the bias after a second, over many seconds."""
    found = (triad(Noise(walk=0.5)).read(np.zeros((200_000, 3))) - 3e-5) / DT
    steps = found[100::100] - found[:-100:100]
    np.testing.assert_allclose(steps.var(axis=0), 0.5**2, rtol=0.12)


def test_counts_lose_nothing() -> None:
    true = np.full((1000, 3), 0.26)
    found = Triad(np.zeros(3), np.eye(3), Noise(lsb=1.0), (1,), DT).read(true)
    assert set(found.ravel()) == {0.0, 1.0}
    np.testing.assert_allclose(found.sum(axis=0), 260.0)


@pytest.mark.parametrize("noise", [Noise(white=1.0), Noise(walk=1.0), Noise(0.1, 0.2, 0.03)])
def test_pieces_make_no_difference(noise: Noise) -> None:
    true = np.linspace(0.0, 1.0, 300).reshape(100, 3)
    whole, pieces = triad(noise).read(true), triad(noise)
    found = np.concatenate(
        [pieces.read(true[:33]), pieces.read(true[33:34]), pieces.read(true[34:])]
    )
    np.testing.assert_allclose(found, whole, rtol=0.0, atol=1e-12)


def test_one_error_leaves_the_others() -> None:
    """The walk is the same with white noise and without; another seed is other noise."""
    true = np.zeros((50, 3))
    both, white, walk = (triad(Noise(*n)).read(true) for n in ((1.0, 2.0), (1.0, 0.0), (0.0, 2.0)))
    np.testing.assert_allclose(both, white + walk - 3e-5, rtol=0.0, atol=1e-12)
    assert np.abs(triad(Noise(1.0), seed=2).read(true) - white).min() > 0.0


def test_the_sensors_that_are_named() -> None:
    """0.0005 deg/h^(1/2): after an hour 0.0005 deg; 1e-3 deg/h in an hour; ug alike."""
    assert FIBRE_OPTIC.white * 60.0 == pytest.approx(math.radians(5e-4))
    assert FIBRE_OPTIC.walk * 60.0 == pytest.approx(1e-3 * math.radians(1.0 / 3600.0))
    assert ACCELEROMETER.white == pytest.approx(5.0 * MICRO_G)
    assert ACCELEROMETER.walk * 60.0 == pytest.approx(5.0 * MICRO_G)
    assert pytest.approx(math.radians(1.0)) == PER_HOUR * 3600.0
