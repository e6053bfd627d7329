"""Random programs are legal and varied."""

from __future__ import annotations

import pytest

from boresight.model.words.program import Kind, Negate, Overflow, Program, Scale, When
from tests.support.random_program import random_inputs, random_program


def magnitude(program: Program) -> int:
    """Largest magnitude that any accumulator can reach."""
    arith = program.arithmetic
    most = 0
    for op in program.ops:
        total = 1 << (arith.guard - 1)
        for t in op.terms:
            lost = 0
            if t.scale is not Scale.NONE and (t.a != op.norm or t.fraction_a):
                lost = arith.norm_max // (2 if t.scale is Scale.HALF else 1)
            assert 0 <= t.shift <= arith.shift_max
            total += (1 << (2 * arith.word - 2)) >> max(0, t.shift - lost)
        most = max(most, total)
    return most


@pytest.mark.parametrize("word", [18, 24, 32])
def test_accumulator_holds_every_sum(word: int) -> None:
    for seed in range(60):
        p = random_program(seed, word=word, n_ops=60)
        assert magnitude(p) < 1 << (p.arithmetic.acc_width - 1)


def test_same_seed_same_program() -> None:
    assert random_program(5) == random_program(5)
    assert random_program(5).digest != random_program(6).digest
    p = random_program(5)
    assert random_inputs(p, 1, 4) == random_inputs(p, 1, 4)
    assert Program.from_json(p.to_json()) == p


def test_everything_occurs() -> None:
    ops = [op for seed in range(40) for op in random_program(seed).ops]
    terms = [t for op in ops for t in op.terms]
    assert {op.overflow for op in ops} == set(Overflow)
    assert {t.negate for t in terms} == set(Negate)
    assert {t.when for t in terms} == set(When)
    assert {t.scale for t in terms} == set(Scale)
    assert {t.coefficient for t in terms} == {None, 0, 1, 2, 3}
    assert {op.table for op in ops} == {None, 0, 1, 2}
    assert {op.flag_quarter for op in ops} == {op.index_quarter for op in ops} == {False, True}


def test_states_and_sizes() -> None:
    kinds = set()
    for seed in range(40):
        p = random_program(seed, n_ops=25, n_inputs=3, n_outputs=4, n_states=5)
        assert (len(p.ops), len(p.inputs), len(p.outputs), len(p.states)) == (25, 3, 4, 5)
        kinds |= {p.values[after].kind for _, after in p.states}
    assert kinds == set(Kind)


def test_errors() -> None:
    with pytest.raises(ValueError, match=r"^n_ops must be at least 1, not 0$"):
        random_program(0, n_ops=0)
    with pytest.raises(ValueError, match=r"^recent must be 0 to 1, not 2$"):
        random_program(0, recent=2)
