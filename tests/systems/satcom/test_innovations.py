"""Innovations: known sequences, and the bands of white noise."""

import numpy as np
import pytest

from boresight.systems.satcom.innovations import innovations


def test_known_sequence() -> None:
    x = np.array([1.0, -1.0, 9.0, 1.0, -1.0, 1.0])
    result = innovations(x, x != 9.0, lags=2)
    assert result.nis == 1.0 and result.nis_band == pytest.approx(1.96 * np.sqrt(2.0 / 5.0))
    assert result.correlation.tolist() == [-1.0, pytest.approx(0.0)]  # 2 of 3 gone; lag 2: 1, -1
    assert result.band == pytest.approx(1.96 / np.sqrt(5.0))


def test_a_consistent_filter_is_within_its_bands() -> None:
    rng = np.random.default_rng(1)
    runs = [innovations(rng.normal(size=2000), rng.random(2000) < 0.7) for _ in range(200)]
    outside = np.mean([abs(r.nis - 1.0) > r.nis_band for r in runs])
    assert 0.01 < outside < 0.1
    beyond = np.mean([np.abs(r.correlation) > r.band / np.sqrt(0.7) for r in runs])
    assert 0.02 < beyond < 0.08


def test_a_smooth_one_is_not_white() -> None:
    white = np.random.default_rng(2).normal(size=5000)
    smooth = np.convolve(white, np.ones(5) / np.sqrt(5.0), "valid")
    result = innovations(2.0 * smooth, np.ones(len(smooth), dtype=bool))
    assert result.nis == pytest.approx(4.0, rel=0.15)
    assert result.correlation[:4] == pytest.approx([0.8, 0.6, 0.4, 0.2], abs=0.1)
