"""Topics of a recording: messages of one kind each, with times of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import BoolArray, IntArray

__all__ = ["GAP_STEPS", "Clock", "Recording", "Topic"]


#: Median steps from which on a step is a gap.
GAP_STEPS = 3.0
NS = 1e9  #: nanoseconds of a second


@dataclass(frozen=True, eq=False)
class Topic:
    """Messages of one name, as recorded.

    Attributes
    ----------
    name, kind : str
        Name, and type of the messages.
    stamps : int64 (n,)
        Times [ns].
    fields : mapping of str to array (n,)
        Numbers of each message, by the path to them: ``angular_velocity.x``, ``q[0]``.
    """

    name: str
    kind: str
    stamps: IntArray
    fields: Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Recording:
    """Topics of a file, and remarks about it."""

    topics: tuple[Topic, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Clock:
    """Times of samples in the order in which they were recorded.

    Attributes
    ----------
    samples : int
    rate_hz : float or None
        Of the median step; None of fewer than two times.
    jitter_s : float
        Root mean square of the steps' distance from the median, without gaps.
    gaps : int
        Steps above `GAP_STEPS` medians.
    longest_s : float
        The longest step.
    repeated, late : int
        Samples with the time of an earlier one, or a time before it.
    """

    samples: int
    rate_hz: float | None
    jitter_s: float
    gaps: int
    longest_s: float
    repeated: int
    late: int

    @classmethod
    def of(cls, stamps: IntArray) -> Clock:
        """The clock of times [ns]."""
        rising = increasing(stamps)
        steps = np.diff(stamps[rising]) / NS
        repeated, late = (int((x & ~rising).sum()) for x in _earlier(stamps))
        if not len(steps):
            return cls(len(stamps), None, 0.0, 0, 0.0, repeated, late)
        median = float(np.median(steps))
        gaps = steps > GAP_STEPS * median
        jitter = float(np.sqrt(np.mean(np.square(steps[~gaps] - median))))
        longest = float(steps.max())
        return cls(len(stamps), 1.0 / median, jitter, int(gaps.sum()), longest, repeated, late)

    def notes(self, name: str, rows: bool = False) -> list[str]:
        """A line for each irregularity; with ``rows`` also of the steps."""
        lines = []
        if self.late:
            lines.append(f"{name}: samples earlier than one before, left out: {self.late}")
        if self.repeated:
            lines.append(f"{name}: samples with the time of one before, left out: {self.repeated}")
        if rows and self.gaps:
            lines.append(
                f"{name}: gaps in the times: {self.gaps}, the longest of {self.longest_s:.3g} s"
            )
        if rows and self.rate_hz and self.jitter_s * self.rate_hz > 0.1:
            lines.append(
                f"{name}: steps of {1e3 / self.rate_hz:.3g} ms differ by {1e3 * self.jitter_s:.3g} "
                "ms (rms)"
            )
        return lines


def _earlier(stamps: IntArray) -> tuple[BoolArray, BoolArray]:
    """Samples at the largest time so far, and samples before it."""
    if not len(stamps):
        return np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    greatest = np.maximum.accumulate(stamps)[:-1]
    repeated, earlier = stamps[1:] == greatest, stamps[1:] < greatest
    return np.concatenate([[False], repeated]), np.concatenate([[False], earlier])


def increasing(stamps: IntArray) -> BoolArray:
    """Samples later than every one before them."""
    repeated, earlier = _earlier(stamps)
    return ~(repeated | earlier)
