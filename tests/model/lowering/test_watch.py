"""The flag of an input beyond its range is exact at both ends, in words of any width."""

import random

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.lowering.lower import watched
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Program, Value


@pytest.mark.parametrize("word", [18, 25, 32])
def test_first_and_last_words(word: int) -> None:
    arith, rng = Arithmetic(word), random.Random(word)
    first, last = arith.min_int, arith.max_int
    ranges = [(first, last), (0, 0), (-1, 0), (first, -1), (0, last), (first + 1, last - 1)]
    for _ in range(30):
        a, b = sorted(round(rng.uniform(-1.0, 1.0) * 2 ** rng.uniform(0, word - 1)) for _ in "ab")
        a, b = max(a, first), min(b, last)
        high = min(abs(a), last)
        ranges += [(a, b), (first, b), (a, last), (-high, high)]
    values = tuple(Value(f"x{k}", Kind.INPUT, 0, *r, "test") for k, r in enumerate(ranges))
    numbers = tuple(range(len(values)))
    program = Program("ends", arith, values, (), numbers, (0,), ("y",), (), ())
    rows, wanted = [[low for low, _ in ranges]], [False]
    for k, (low, high) in enumerate(ranges):
        for x in (low - 1, low, high, high + 1, first, last):
            if first <= x <= last:
                rows.append([*rows[0][:k], x, *rows[0][k + 1 :]])
                wanted.append(not low <= x <= high)
    program = watched(program, numbers)
    model = CModel(program)
    model.update(np.array(rows))
    assert model.beyond.tolist() == program.beyond(np.array(rows)).tolist() == wanted
