"""Programs as plain integers: the words that arrays give."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import FEW, Interpreter
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value
from boresight.model.words.single import single
from tests.support.random_program import random_inputs, random_program

MANY = FEW + 1


@pytest.mark.parametrize("word", [18, 27, 32])
@pytest.mark.parametrize("seed", range(14))
def test_equals_the_arrays(seed: int, word: int) -> None:
    """All words, saturations by value and by run; `test_random_program` says what occurs."""
    program = random_program(seed, word=word, n_ops=60)
    inputs = np.array([random_inputs(program, seed, 4) for seed in range(MANY)])
    inputs = inputs.transpose(1, 2, 0)  # (steps, n_inputs, runs)
    arrays, counts = Interpreter(program, MANY), np.zeros(len(program.values), dtype=np.int64)
    out, saturated = arrays.run(inputs)
    for some in (slice(0, 1), slice(1, MANY)):
        one = Interpreter(program, inputs[:, :, some].shape[2])
        found, flags = one.run(inputs[:, :, some])
        assert np.array_equal(found, out[:, :, some])
        assert np.array_equal(flags, saturated[:, some])
        for words, wanted in zip(
            one.values_before_commit(), arrays.values_before_commit(), strict=True
        ):
            assert np.array_equal(words, wanted[some])
        counts += one.saturations
    assert np.array_equal(counts, arrays.saturations)


@pytest.mark.parametrize("word", range(18, 33))
def test_normalisation_at_every_edge(word: int) -> None:
    """x, shifted left as far as it goes."""
    arith = Arithmetic(word)
    values = (
        Value("x", Kind.INPUT, 0, -1.0, 1.0, "declared"),
        Value("one", Kind.CONST, 0, 1.0, 1.0, "constant", initial=1 << (word - 2)),
        Value("y", Kind.OP, 0, -1.0, 1.0, "interval"),
    )
    op = Op(2, (Term(0, 1, word - 2 - arith.guard, scale=Scale.FULL),), norm=0)
    program = Program("normalised", arith, values, (op,), (0,), (2,), ("y",), (), ())
    powers = [s * (1 << k) + d for k in range(word) for s in (1, -1) for d in (-1, 0, 1)]
    x = np.array([sorted({n for n in powers if arith.min_int <= n <= arith.max_int})])
    wanted, _ = Interpreter(program, x.shape[1]).update(x)
    for n, y in zip(x[0].tolist(), wanted[0].tolist(), strict=True):
        words = [n, 1 << (word - 2), 0]
        assert single(program)(words, ()) == [] and words[2] == y, n
