"""Forms before they are groups: powers of two, signs, and what may be added to what."""

import math

import pytest

from boresight.model.lowering.forms import CONDITIONAL, OPPOSITE, Form, Product
from boresight.model.words.program import Negate, Scale, Term, When

pytestmark = pytest.mark.pythons


def test_signs() -> None:
    assert all(OPPOSITE[OPPOSITE[sign]] is sign is not OPPOSITE[sign] for sign in Negate)
    # Where the flag is 0 the conditional sign is the plain one, where it is 1 the opposite.
    assert CONDITIONAL == {Negate.NO: Negate.IF, Negate.YES: Negate.UNLESS}


@pytest.mark.parametrize(
    ("product", "single"),
    [(Product(3), True), (Product(3, 4), False), (Product(3, coefficient=0), False)],
)
def test_a_product_of_one_factor(product: Product, single: bool) -> None:
    assert product.times_one is single


@pytest.mark.parametrize("power", [1.0, 4.0, 0.125, -2.0, -0.5])
@pytest.mark.parametrize("negate", list(Negate))
def test_powers_of_two(power: float, negate: Negate) -> None:
    result = Product(1, 2, exponent=3, negate=negate, limit=5.0).times_power(power)
    assert 2.0**result.exponent == 8.0 * abs(power) and result.limit == 5.0 * abs(power)
    assert result.negate is (OPPOSITE[negate] if power < 0.0 else negate)
    assert (result.a, result.b) == (1, 2)
    assert math.isinf(Product(1).times_power(power).limit)


@pytest.mark.parametrize(
    ("a", "b", "joins"),
    [
        ({}, {}, True),
        ({"flag": (1, False)}, {}, True),
        ({"flag": (1, False)}, {"flag": (1, False)}, True),
        ({"flag": (1, False)}, {"flag": (2, False)}, False),
        ({"flag": (1, False)}, {"flag": (1, True)}, False),
        ({"norm": 0}, {"norm": 0}, True),
        ({"norm": 0}, {"norm": 1}, False),
        ({"norm": 0}, {"flag": (1, False)}, True),
    ],
)
def test_one_flag_and_one_count_for_each_group(a, b, joins: bool) -> None:
    for item, other in ((a, b), (b, a)):
        assert Form(**item).joins(Form(**other)) is joins
    if joins:
        form = Form(**a)
        form.join(Form(**b), 1)
        assert (form.flag, form.norm) == (
            a.get("flag") or b.get("flag"),
            a["norm"] if "norm" in a else b.get("norm"),
        )


@pytest.mark.parametrize("sign", [1, -1])
def test_sums_and_differences(sign: int) -> None:
    form = Form([Product(1)], constant=0.5)
    form.join(Form([Product(2, negate=Negate.IF), Product(3)], constant=0.25), sign)
    assert form.constant == 0.5 + sign * 0.25
    signs = (Negate.IF, Negate.NO) if sign > 0 else (Negate.UNLESS, Negate.YES)
    assert form.products == [Product(1), Product(2, negate=signs[0]), Product(3, negate=signs[1])]


def test_a_term_keeps_all_but_the_exponent() -> None:
    p = Product(1, None, 5, 2, Negate.YES, When.IF, True, False, Scale.HALF, 3.0)
    assert p.term(7, None) == Term(1, None, 7, 2, Negate.YES, When.IF, True, False, Scale.HALF)
    assert Product(4).term(3, 0) == Term(4, 0, 3)
