"""Pieces that are made while others are used."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from boresight.model.errors import InputError
from boresight.sim.records.files import ahead
from boresight.sim.records.selection import Selection, selected, selection

pytestmark = pytest.mark.pythons


def test_the_next_is_made_while_the_last_is_used() -> None:
    """In another thread, which has the caller's selection and ends with its last item."""
    reached = [threading.Event() for _ in range(3)]

    def items() -> Iterator[tuple[int, int, Selection]]:
        for k in range(3):
            reached[k].set()
            yield k, threading.get_ident(), selection()

    threads = threading.active_count()
    with selected(Selection(every=3)):
        for k, (item, thread, what) in enumerate(ahead(items())):
            assert k == 2 or reached[k + 1].wait(10.0)
            assert (item, what.every) == (k, 3) and thread != threading.get_ident()
    assert k == 2 and threading.active_count() == threads


def test_what_is_refused_comes_after_what_was_made() -> None:
    def items() -> Iterator[int]:
        yield 1
        raise InputError("row 2")

    taken = []
    with pytest.raises(InputError, match="row 2"):
        for item in ahead(items()):
            taken.append(item)
    assert taken == [1]


def test_left_early_it_ends() -> None:
    threads = threading.active_count()
    pieces = ahead(iter(range(10)))
    assert next(pieces) == 0
    pieces.close()  # type: ignore[attr-defined]
    assert threading.active_count() == threads
