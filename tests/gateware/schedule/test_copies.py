"""Copies change nothing but where the next states come from."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.gateware.schedule.copies import copy_shift, with_copies
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind
from tests.support.random_program import random_inputs, random_program


@pytest.mark.parametrize("seed", range(20))
def test_equals_the_source(seed: int) -> None:
    p = random_program(seed, n_states=6)
    low = with_copies(p)
    assert len({after for _, after in low.states}) == len(low.states)
    assert all(low.values[after].kind is Kind.OP for _, after in low.states)
    assert len({v.name for v in low.values}) == len(low.values)
    source, copied = Interpreter(p), Interpreter(low)
    for words in random_inputs(p, seed, 8):
        column = np.array(words)[:, None]
        for a, b in zip(source.update(column), copied.update(column), strict=True):
            assert (a == b).all()


def test_nothing_to_copy() -> None:
    p = random_program(0, n_states=0)
    assert with_copies(p) == p


def test_copy_shift() -> None:
    arith = Arithmetic()
    assert copy_shift(1 << 8, arith) == 0
    assert copy_shift(1 << 30, arith) == 22
    for word in (0, 1, 1 << 7, 3 << 8, -(1 << 31), 1 << 31):
        assert copy_shift(word, arith) is None
