"""The receiver: errors with their sign, lock, intervals."""

import math

import numpy as np
import pytest

from boresight.systems.satcom.dish import Link
from boresight.systems.satcom.receiver import Receiver


def scan(right: float, up: float, *, loss: float = 1.0, ahead: float = 1.0, runs: int = 400):
    """Errors (2, runs) [deg] and mean powers of one interval."""
    receiver = Receiver(Link(), 10)
    noise = np.random.default_rng(1).normal(size=(10, 4, 2, runs))
    at = [np.full(runs, v) for v in (right, up, ahead)]
    for k in range(9):
        assert receiver.sample(*at, loss, noise[k]) is None
    found = receiver.sample(*at, loss, noise[9])
    assert found is not None
    return np.degrees(found[0]), found[1]


def test_error_is_measured_with_its_sign() -> None:
    error, _ = scan(math.radians(0.2), math.radians(-0.1))
    assert np.nanmean(error, axis=1) == pytest.approx([0.2, -0.1], abs=0.02)
    assert 0.05 < error.std(axis=1).max() < 0.25


def test_lock_follows_from_the_signal() -> None:
    for right, loss, ahead in ((0.0, 1e-6, 1.0), (math.radians(3.6), 1.0, 1.0), (0.0, 1.0, -1.0)):
        error, _ = scan(right, 0.0, loss=loss, ahead=ahead)
        assert np.isnan(error).all()
    error, power = scan(math.radians(0.5), 0.0)
    assert not np.isnan(error).any() and (power > 0.0).all()


def test_intervals_are_independent() -> None:
    receiver = Receiver(Link(), 1)
    zero, one = np.zeros(1), np.ones(1)
    quiet = np.zeros((4, 2, 1))
    first = receiver.sample(np.array([0.004]), zero, one, 1.0, quiet)
    second = receiver.sample(zero, zero, one, 1.0, quiet)
    assert first is not None and second is not None
    assert first[0][0, 0] > 0.003 and second[0][0, 0] == 0.0


def test_an_interval_need_not_be_whole() -> None:
    """20 Hz of records at 50 Hz: two and three of them, in turns."""
    receiver = Receiver(Link(), 2.5)
    zero, one, quiet = np.zeros(1), np.ones(1), np.zeros((4, 2, 1))
    ends = [receiver.sample(zero, zero, one, 1.0, quiet) is not None for _ in range(100)]
    assert np.diff(np.flatnonzero(ends)).tolist() == [2, 3] * 19 + [2]
