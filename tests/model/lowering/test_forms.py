"""Sums of products before their shifts are known."""

from __future__ import annotations

from dataclasses import replace

from boresight.model.lowering.forms import CONDITIONAL, OPPOSITE, Form, Product
from boresight.model.words.program import Negate, Scale, Term, When


def test_times_a_power_of_two() -> None:
    p = Product(1, 2, exponent=3, negate=Negate.IF, limit=8.0)
    assert p.times_power(0.25) == replace(p, exponent=1, limit=2.0)
    assert p.times_power(-4.0) == replace(p, exponent=5, limit=32.0, negate=Negate.UNLESS)
    assert not p.times_one and Product(1).times_one and not Product(1, coefficient=0).times_one


def test_signs_turn_over() -> None:
    assert all(OPPOSITE[OPPOSITE[sign]] is sign for sign in Negate)
    assert {OPPOSITE[CONDITIONAL[s]] for s in CONDITIONAL} == {Negate.IF, Negate.UNLESS}


def test_a_term_keeps_all_but_the_exponent() -> None:
    p = Product(1, None, 5, 2, Negate.YES, When.IF, True, False, Scale.HALF, 3.0)
    assert p.term(7, None) == Term(1, None, 7, 2, Negate.YES, When.IF, True, False, Scale.HALF)
    assert Product(4).term(3, 0) == Term(4, 0, 3)


def test_what_joins() -> None:
    plain, flagged = Form([Product(1)], 0.5), Form([Product(2)], 0.25, flag=(7, False))
    normal = Form([Product(3)], norm=0)
    assert plain.joins(flagged) and flagged.joins(normal) and flagged.joins(flagged)
    assert not flagged.joins(Form(flag=(7, True))) and not normal.joins(Form(norm=4))
    flagged.join(plain, -1)
    assert flagged.constant == -0.25 and flagged.flag == (7, False) and flagged.norm is None
    assert flagged.products == [Product(2), Product(1, negate=Negate.YES)]
    flagged.join(normal, 1)
    assert flagged.norm == 0 and flagged.products[-1] == Product(3)
