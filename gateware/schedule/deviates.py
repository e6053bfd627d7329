"""Normally distributed numbers for the scheduler's search, the same on every machine."""

from __future__ import annotations

import math
import random

from boresight.model.words.rounded import cos_ht, log, sin_ht


class Deviates:
    """Normal deviates by the method of Box and Muller, in pairs, correctly rounded.

    `random.Random.gauss` computes the same with the C library's functions, whose last bits differ
    between machines, which could change a schedule.

    Parameters
    ----------
    rng : random.Random
        Source of uniform numbers; only its ``random`` is used.
    """

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self._spare: float | None = None

    def draw(self, deviation: float) -> float:
        """A number of mean 0 and this standard deviation."""
        z = self._spare
        self._spare = None
        if z is None:
            angle = 2.0 * self._rng.random()
            radius = math.sqrt(-2.0 * log(1.0 - self._rng.random()))
            z = cos_ht(angle) * radius
            self._spare = sin_ht(angle) * radius
        return z * deviation
