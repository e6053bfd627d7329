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
    place_of_steps,
    refuse_late,
    rows_of,
    steps_of,
)
from boresight.sim.records.text import ROWS

__all__ = ["ahead", "resized", "timed"]

T = TypeVar("T")


def timed(blocks: Iterable[Record]) -> Iterator[Record]:
    """Blocks of one log, each with its time steps as a part of the log.

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
    t_last: float | None = None
    column_last = 0.0  # t_last, in the unit of the column
    for block in chain([joined(first)], blocks):
        if "t" not in block.columns or "dt" in block.columns or len(block) == 1 and t_last is None:
            yield block
            continue
        t = block.values("t", "s")
        if t_last is None:
            steps = steps_of(block.where, t)
        else:
            refuse_late(block, column_last)
            steps = np.diff(t, prepend=t_last)
        t_last, column_last = float(t[-1]), float(block.columns["t"].values[-1])
        columns = {**block.columns, "dt": Column(steps)}
        yield block.derived(columns, place_of_steps(block.place))


def resized(blocks: Iterable[Record], rows: int = ROWS) -> Iterator[Record]:
    """The same rows in blocks of so many; the last may be shorter."""
    pending, count = list[Record](), 0
    for block in blocks:
        pending.append(block)
        count += len(block)
        if count < rows:
            continue
        merged = joined(pending)
        for start in range(0, count - count % rows, rows):
            yield rows_of(merged, start, start + rows)
        pending = [rows_of(merged, count - count % rows, count)] if count % rows else []
        count %= rows
    if pending:
        yield joined(pending)


def ahead(items: Iterable[T]) -> Iterator[T]:
    """The same items, none of them None, each made in a thread while the last one is used."""
    make = partial(copy_context().run, next, iter(items), None)
    with ThreadPoolExecutor(1) as thread:
        future = thread.submit(make)
        while (item := future.result()) is not None:
            future = thread.submit(make)
            yield item
