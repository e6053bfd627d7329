"""The interpreters, on integers and on terms."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import FEW, Interpreter, Terms, compiled
from boresight.model.words.program import (
    ALWAYS,
    NEVER,
    Condition,
    Kind,
    Negate,
    Op,
    Overflow,
    Program,
    Scale,
    Term,
    Value,
)
from tests.support.random_program import random_inputs, random_program

# -- the interpreter: shapes, refusals, runs side by side, flags and counters ---------------------


def machine(overflow: Any = Overflow.SAT, runs: int = 1) -> Any:
    """An interpreter of: sum' = sum + step * gain, in 18 bits."""
    word, arith = 18, Arithmetic(word=18)
    values = (
        Value("step", Kind.INPUT, 0, -1e5, 1e5, "declared"),
        Value("gain", Kind.PARAM, 0, 0.0, 9.0, "declared", "", 2),
        Value("sum", Kind.STATE, 0, -1e5, 1e5, "declared", "", 7),
        Value("one", Kind.CONST, word - 2, 1.0, 1.0, "constant", "", 1 << (word - 2)),
        Value("next", Kind.OP, 0, -1e5, 1e5, "interval"),
    )
    # a product of integers counts 2^-guard: as many of them as make one
    terms = (Term(2, 3, word - 2 - arith.guard), *(Term(0, 1, 0),) * (1 << arith.guard))
    return Interpreter(
        Program(
            "sum",
            arith,
            values,
            (Op(4, terms, overflow),),
            (0,),
            (2, 4),
            ("before", "after"),
            ((2, 4),),
            (),
        ),
        runs,
    )


def test_states_parameters_and_outputs() -> None:
    m = machine()
    seen = [m.update([[s]])[0].ravel().tolist() for s in (10, 0, -4)]
    assert seen == [[7, 27], [27, 27], [27, 19]]
    assert m.values[2].tolist() == [19]
    assert m.values_before_commit()[2].tolist() == [27]
    assert m.values_before_commit()[4].tolist() == [19]
    m.params[1] = 5
    assert m.update([[1]])[0].ravel().tolist() == [19, 24]


@pytest.mark.parametrize(
    ("overflow", "after", "flagged"),
    [
        (Overflow.SAT, [131071, -131072, 47], [True, True, False]),
        (Overflow.CLIP, [131071, -131072, 47], [False] * 3),
        (Overflow.WRAP, [7 + 200_000 - 262_144, 7 - 200_000 + 262_144, 47], [False] * 3),
    ],
)
def test_overflow_flags_and_counters(overflow: Any, after: Any, flagged: Any) -> None:
    m = machine(overflow, runs=3)
    out, saturated = m.update([[100_000, -100_000, 20]])
    assert out[1].tolist() == after
    assert saturated.tolist() == flagged
    assert m.saturations.tolist() == [0, 0, 0, 0, sum(flagged)]
    out, saturated = m.update([[0, 0, 0]])
    assert not saturated.any()
    assert m.saturations.sum() == sum(flagged)  # counts stay, flags do not
    m.update([[100_000, 0, 0]])
    assert m.saturations[4] == sum(flagged) + flagged[0]


# -- programs as plain integers: the words that arrays give ---------------------------------------

MANY = FEW + 1


@pytest.mark.parametrize("word", [18, 27, 32])
@pytest.mark.parametrize("seed", range(14))
def test_equals_the_arrays(seed: int, word: int) -> None:
    """All words, saturations by value and by run; `test_program` says what occurs."""
    program = random_program(seed, word=word, n_ops=60)
    inputs = np.array([random_inputs(program, seed, 4) for seed in range(MANY)])
    inputs = inputs.transpose(1, 2, 0)  # (steps, n_inputs, runs)
    arrays, counts = Interpreter(program, MANY), np.zeros(len(program.values), dtype=np.int64)
    out, saturated = arrays.run(inputs)
    for some in (slice(0, 1), slice(1, MANY)):
        machine = Interpreter(program, inputs[:, :, some].shape[2])
        result, flags = machine.run(inputs[:, :, some])
        assert np.array_equal(result, out[:, :, some])
        assert np.array_equal(flags, saturated[:, some])
        for words, wanted in zip(
            machine.values_before_commit(), arrays.values_before_commit(), strict=True
        ):
            assert np.array_equal(words, wanted[some])
        counts += machine.saturations
    assert np.array_equal(counts, arrays.saturations)
    assert out.shape == (4, len(program.outputs), MANY) and out.dtype == np.int64


@pytest.mark.parametrize("count", [255, 256, 257, 600])
def test_a_sum_of_many_terms(count: int) -> None:
    """Alternately plus a word and minus half of it, each counted in parts of the guard bits."""
    (program, arith) = machine().program, machine().program.arithmetic
    terms = [Term(2, 3, 16 - arith.guard), Term(0, 3, 17 - arith.guard, negate=Negate.YES)]
    op = Op(4, tuple(terms[k % 2] for k in range(count)))
    program = replace(program, ops=(op,))
    wanted = 7 * ((count + 1) // 2) - (count // 2) * 5
    for runs in (1, MANY):
        out, _ = Interpreter(program, runs).update(np.full((1, runs), 10))
        assert (out[1] == wanted).all()


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
        assert compiled(program, arrays=False)(words, ()) == [False] and words[2] == y, n


def test_a_word_moved_up_and_down_again_is_its_copy() -> None:
    terms = Terms(Arithmetic(18))
    x, guard = terms.symbol("x"), terms.arithmetic.guard
    flag = terms.sign(x, quarter=False)

    def result(
        factor: int,
        shift: int,
        negate: Condition[int] = NEVER,
        take: Condition[int] = ALWAYS,
        before: int | None = None,
    ) -> int:
        product = terms.product(x, terms.word(factor))
        shifted = terms.shifted(product, terms.amount(shift))
        return terms.result(terms.total(before, shifted, negate, take), wrap=False)

    assert {result(1 << shift + guard, shift) for shift in range(13)} == {x}
    assert x not in {
        *(result(1 << 3 + guard, shift) for shift in (2, 4)),
        result(3 << guard, 1),
        result(1 << guard, 0, negate=(True, None)),
        result(1 << guard, 0, take=(False, flag)),
        result(1 << guard, 0, before=terms.symbol("left in acc")),
        result(1 << guard, 0, take=NEVER, before=terms.symbol("left in acc")),
        terms.result(terms.symbol("left in acc"), wrap=False),
    }
    scaled = terms.amount(3, Scale.FULL, terms.count(x))
    for product, amount in (
        (terms.product(x, terms.word(1 << 3 + guard)), scaled),
        (terms.fraction(x), terms.amount(3)),
    ):
        total = terms.total(None, terms.shifted(product, amount), NEVER, ALWAYS)
        assert terms.may_overflow(terms.result(total, wrap=False))
    assert terms.may_overflow(terms.result(terms.total(None, x, NEVER, ALWAYS), wrap=False))
