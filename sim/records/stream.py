"""Logs of any length in pieces: read, with their time steps, and written row by row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import partial
from itertools import chain
from typing import TypeVar

import numpy as np

from boresight.sim.records.record import (
    MEDIAN_OF,
    Column,
    Record,
    joined,
    refuse_late,
    rows_of,
    steps_of,
)
from boresight.sim.records.text import ROWS

__all__ = ["ahead", "resized", "timed"]

T = TypeVar("T")


def timed(blocks: Iterable[Record]) -> Iterator[Record]:
    """Blocks of one log, each with the time steps that it has as a part of the whole.

    Raises
    ------
    InputError
        A time that does not increase from one block to the next.
    """
    blocks, first = iter(blocks), list[Record]()
    for block in blocks:
        first.append(block)
        if sum(map(len, first)) > MEDIAN_OF:
            break
    if not first:
        return
    before: float | None = None
    last = 0.0  # before, in the unit of the column
    for block in chain([joined(first)], blocks):
        if "t" not in block.columns or "dt" in block.columns or len(block) == 1 and before is None:
            yield block
            continue
        t = block.values("t", "s")
        if before is None:
            steps = steps_of(block.where, t)
        else:
            refuse_late(block, last)
            steps = np.diff(t, prepend=before)
        before, last = float(t[-1]), float(block.columns["t"].values[-1])
        yield block.derived({**block.columns, "dt": Column(steps)})


def resized(blocks: Iterable[Record], rows: int = ROWS) -> Iterator[Record]:
    """The same rows in blocks of so many; the last may be shorter."""
    held, count = list[Record](), 0
    for block in blocks:
        held.append(block)
        count += len(block)
        if count < rows:
            continue
        whole = joined(held)
        for start in range(0, count - count % rows, rows):
            yield rows_of(whole, start, start + rows)
        held = [rows_of(whole, count - count % rows, count)] if count % rows else []
        count %= rows
    if held:
        yield joined(held)


def ahead(items: Iterable[T]) -> Iterator[T]:
    """The same items, none of them None, each made in a thread while the last one is used."""
    make = partial(copy_context().run, next, iter(items), None)
    with ThreadPoolExecutor(1) as thread:
        made = thread.submit(make)
        while (item := made.result()) is not None:
            made = thread.submit(make)
            yield item
