"""Topics of a recording: messages of one kind each, with times of their own."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.sim.records.selection import Clock

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


class Order(NamedTuple):
    """Messages in the order of their times.

    Attributes
    ----------
    rows : int (k,)
        The messages that are kept, in the order of their times.
    stamps : int64 (k,)
        Their times [ns], which rise: messages of one time are spread over the step before it.
    sorted, repeated, spread, stray : int
        Messages that were moved to their place in time; that repeat the one before and are left
        out; that shared a time with others; whose time is far from those around them and that are
        left out.
    """

    rows: IntArray
    stamps: IntArray
    sorted: int
    repeated: int
    spread: int
    stray: int

    def notes(self, name: str) -> list[str]:
        """A line for each kind of irregularity, with its count."""
        lines = {
            f"{name}: messages out of order, sorted": self.sorted,
            f"{name}: messages that repeat the one before, left out": self.repeated,
            f"{name}: messages that share a time with others, spread over the step": self.spread,
            f"{name}: messages with a time far from those around them, left out": self.stray,
        }
        return [f"{text}: {count}" for text, count in lines.items() if count]


def order_of(stamps: IntArray, values: FloatArray | None = None) -> Order:
    """The order of times [ns]; messages of one time and equal ``values`` repeat each other."""
    main = _rising(stamps)
    steps = np.diff(stamps[main])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else NS
    expected = np.interp(np.arange(len(stamps)), np.flatnonzero(main), stamps[main])
    kept = main | (np.abs(stamps - expected) <= _NEAR_STEPS * step)
    index = np.flatnonzero(kept)
    index = index[np.argsort(stamps[index], kind="stable")]
    same = np.zeros(len(index), dtype=bool)
    if values is not None:
        same[1:] = (np.diff(stamps[index]) == 0) & (np.diff(values[index], axis=0) == 0.0).all(
            axis=1
        )
    index = index[~same]
    times = stamps[index]
    spread = _spread(times)
    counts = (kept & ~main, same, spread != times, ~kept)
    return Order(index, spread, *(int(x.sum()) for x in counts))


#: Median steps by which a message may be displaced and is sorted, not left out.
_NEAR_STEPS = 32.0


def _rising(stamps: IntArray) -> BoolArray:
    """A longest part of the messages whose times never fall."""
    if (np.diff(stamps) >= 0).all():
        return np.ones(len(stamps), dtype=bool)
    ends: list[int] = []  # of a part of each length, the least last time
    last: list[int] = []  # and which message that is
    before: list[int] = []
    for k, stamp in enumerate(stamps.tolist()):
        length = bisect_right(ends, stamp)
        before.append(last[length - 1] if length else -1)
        ends[length : length + 1], last[length : length + 1] = [stamp], [k]
    main = np.zeros(len(stamps), dtype=bool)
    k = last[-1]
    while k >= 0:
        main[k], k = True, before[k]
    return main


def _spread(times: IntArray) -> IntArray:
    """Equal times, which follow each other, spread over the step before them."""
    values, first, counts = np.unique(times, return_index=True, return_counts=True)
    if len(values) in (0, len(times)):
        return times
    steps = np.diff(values)
    usual = int(np.median(steps)) if len(steps) else int(NS * 1e-3)
    room = np.minimum(np.concatenate([[usual], steps]), usual)
    place = np.arange(len(times)) - np.repeat(first, counts)
    back = np.repeat(counts, counts) - 1 - place
    shift = np.repeat(room, counts) * back // np.repeat(counts, counts)
    return np.asarray(times - shift, dtype=np.int64)


def clock_of(stamps: IntArray) -> Clock:
    """The clock of messages' times [ns], in any order."""
    order = order_of(stamps)
    clock = Clock.of_steps(np.diff(np.unique(stamps[order.rows])).astype(np.float64) / NS)
    late = order.sorted + order.stray
    return replace(clock, samples=len(stamps), repeated=order.spread, late=late)
