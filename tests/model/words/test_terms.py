"""Symbolic words by themselves: which are equal, and how a message shows them."""

from __future__ import annotations

from itertools import permutations

import pytest

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Scale
from boresight.model.words.terms import ALWAYS, NEVER, Condition, Terms


@pytest.fixture
def terms() -> Terms:
    return Terms(Arithmetic(18))


def test_equal_terms_have_one_number(terms: Terms) -> None:
    x, y = terms.symbol("x"), terms.symbol("y")
    flag = terms.sign(x, quarter=False)
    products = [terms.product(x, y), terms.product(x, x), terms.product(y, y)]
    parts = [terms.shifted(p, terms.amount(k)) for k, p in enumerate(products)]
    signs = [(NEVER, ALWAYS), ((True, None), (True, flag)), ((False, flag), ALWAYS)]
    sums = set()
    for order in permutations(zip(parts, signs, strict=True)):
        total = None
        for part, conditions in order:
            total = terms.total(total, part, *conditions)
        sums.add(total)
    assert len(sums) == 1 and terms.product(x, y) == terms.product(y, x)


def test_what_differs_has_another_number(terms: Terms) -> None:
    x, y = terms.symbol("x"), terms.symbol("y")
    count = terms.count(x)
    product = terms.product(x, y)
    total = terms.total(None, terms.shifted(product, terms.amount(3)), NEVER, ALWAYS)
    numbers = [
        *(x, y, terms.symbol("x", 1), terms.word(5), terms.fraction(x), count, product),
        *(terms.sign(x, quarter=q) for q in (False, True)),
        *(terms.index(x, quarter=q) for q in (False, True)),
        *(terms.coefficient(a, b, count) for a, b in ((0, 1), (1, 0))),
        *(terms.amount(5, s, count) for s in (Scale.FULL, Scale.EVEN, Scale.HALF)),
        *(terms.shifted(p, terms.amount(s)) for p, s in ((product, 3), (product, 4))),
        *(total, terms.result(total, wrap=True), terms.result(total, wrap=False)),
    ]
    assert len(set(numbers)) == len(numbers)
    assert [terms.is_clamp(n) for n in numbers] == [False] * (len(numbers) - 1) + [True]
    assert terms.value(terms.word(5)) == 5 and terms.value(x) is None
    assert terms.amount(5, Scale.NONE, count) == terms.word(5)


def test_a_word_moved_up_and_down_again_is_its_copy(terms: Terms) -> None:
    x, guard = terms.symbol("x"), terms.arithmetic.guard
    flag = terms.sign(x, quarter=False)

    def result(
        factor: int,
        shift: int,
        negate: Condition = NEVER,
        take: Condition = ALWAYS,
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
        assert terms.is_clamp(terms.result(total, wrap=False))
    assert terms.is_clamp(terms.result(terms.total(None, x, NEVER, ALWAYS), wrap=False))


def test_a_term_as_a_text(terms: Terms) -> None:
    x, y = terms.symbol("x"), terms.symbol("y")
    flag, count = terms.sign(y, quarter=True), terms.count(y)
    first = terms.shifted(terms.product(x, terms.word(7)), terms.amount(3))
    second = terms.shifted(terms.product(x, y), terms.amount(9, Scale.HALF, count))
    plain = terms.total(None, first, NEVER, ALWAYS)
    assert terms.text(plain) == "total(shifted(product(x, 7), 3))"
    assert terms.text(terms.total(None, second, (True, None), (True, flag))) == (
        "total(shifted(product(x, y), 9 - half count(y)) minus if True only if not sign+quarter(y))"
    )
    assert terms.text(terms.total(None, first, (False, flag), NEVER)) == "total()"
    conditional = terms.total(None, first, (False, flag), (False, flag))
    assert terms.text(conditional).endswith("minus if sign+quarter(y) only if sign+quarter(y))")
    look_up = terms.coefficient(2, 1, terms.index(x, quarter=False))
    assert terms.text(look_up) == "table(2, 1, index(x))"


def test_a_text_has_three_levels(terms: Terms) -> None:
    word, texts = terms.symbol("x"), []
    for _ in range(5):
        word = terms.fraction(word)
        texts.append(terms.text(word))
    assert texts[2] == "fraction(fraction(fraction(x)))"
    assert texts[3] == texts[4] == "fraction(fraction(fraction(...)))"
    deep = terms.sign(terms.fraction(terms.fraction(word)), quarter=False)
    for number, text in (
        (deep, "sign(fraction(...))"),
        (terms.coefficient(0, 1, deep), "table(0, 1, sign(...))"),
        (terms.amount(3, Scale.EVEN, deep), "3 - even sign(...)"),
    ):
        assert terms.text(number, 2) == text
    flagged = terms.total(None, terms.symbol("y"), NEVER, (False, deep))
    assert terms.text(flagged, 2) == "total(y only if sign(...))"
