"""Symbolic words by themselves: which are equal, and how a message shows them."""

from __future__ import annotations

import pytest

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import ALWAYS, NEVER, Condition, Scale
from boresight.model.words.terms import Terms


@pytest.fixture
def terms() -> Terms:
    return Terms(Arithmetic(18))


def test_a_word_moved_up_and_down_again_is_its_copy(terms: Terms) -> None:
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
