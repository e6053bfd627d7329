"""Captures that ride on other ops' slots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from boresight.gateware.schedule.captures import Gift, Key, gifts, give, keys
from boresight.gateware.schedule.slots import Slot
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value, When

SQUARE = Op(3, (Term(0, 0, 23),))
TABLE = Op(4, (Term(1, None, 23, 0), Term(0, None, 23, 1)), index=0, table=0)
COSINE = Op(5, (Term(0, None, 23, 1),), index=0, index_quarter=True, table=0)
CHOICE = Op(6, (Term(1, 2, 23, when=When.IF),), flag=0)


def program(*ops: Op) -> Program:
    values = tuple(
        Value(f"x{k}", Kind.PARAM if k < 3 else Kind.OP, 31, -1, 1, "test")
        for k in range(3 + len(ops))
    )
    return Program("p", Arithmetic(), values, ops, (), (), (), (), ())


def always(kind: int, key: Key) -> bool:
    return True


def test_keys() -> None:
    assert keys(SQUARE) == keys(replace(SQUARE, flag=1, norm=1, index=1)) == (None, None, None)
    assert keys(COSINE) == ((0, True), None, None)
    assert keys(CHOICE) == (None, (0, False), None)


def test_square_gives_index_and_flag() -> None:
    offers = gifts(program(SQUARE, TABLE, CHOICE))
    held: list[Key | None] = [None, None, None]
    (slot,) = give([Slot(0, 0, 0, 0, op=0, term=0)], SQUARE, offers[0], held, always)
    assert (slot.cap_index, slot.cap_flag, slot.quarter) == (True, True, False)
    assert held == [(0, False), (0, False), None]


def test_quarters_do_not_mix() -> None:
    offers = gifts(program(SQUARE, COSINE, CHOICE))
    held: list[Key | None] = [None, None, None]
    (slot,) = give([Slot(0, 0, 0, 0, op=0, term=0)], SQUARE, offers[0], held, always)
    assert (slot.cap_index, slot.cap_flag, slot.quarter) == (True, False, True)


def test_table_op_gives_the_next_index_with_its_last_slot() -> None:
    offers = gifts(program(TABLE, COSINE))
    whole, slope = Slot(0, 0, 1, op=0, term=0), Slot(0, 0, 0, op=0, term=1)
    held: list[Key | None] = [(0, False), None, None]
    out = give([whole, slope], TABLE, offers[0], held, always)
    assert [s.cap_index for s in out] == [False, True]
    assert held[0] == (0, True)
    held = [(0, False), None, None]
    out = give([slope, whole], TABLE, offers[0], held, always)
    assert [s.cap_index for s in out] == [False, False]


def test_only_what_is_wished() -> None:
    offers = gifts(program(SQUARE, TABLE, CHOICE))
    held: list[Key | None] = [None, None, None]
    (slot,) = give(
        [Slot(0, 0, 0, 0, op=0, term=0)], SQUARE, offers[0], held, lambda kind, key: kind == 1
    )
    assert (slot.cap_index, slot.cap_flag) == (False, True)


#: Products of which the second uses the flag, the count or neither; and a choice by x2.
PLAIN = Op(3, (Term(0, 1, 23), Term(1, 2, 23)))
FLAGGED = Op(3, (Term(0, 1, 23), Term(1, 2, 23, when=When.IF)), flag=2)
SCALED = Op(3, (Term(0, 1, 23), Term(1, 2, 23, scale=Scale.FULL)), norm=2)
ROOT = Op(7, (Term(1, 2, 23, scale=Scale.EVEN),), norm=0)


def test_offers_are_the_values_of_the_ports() -> None:
    """Late terms first, port a before port b, a square once; each wish once."""
    offers = gifts(program(PLAIN, CHOICE, CHOICE, ROOT))[0]
    assert offers == [Gift(1, (0, False), 0, False), Gift(2, (0, False), 0, False)]
    by_two = replace(CHOICE, flag=1)
    assert gifts(program(PLAIN, by_two))[0] == [
        Gift(1, (1, False), 1, False),
        Gift(1, (1, False), 0, True),
    ]
    assert gifts(program(SQUARE, CHOICE))[0] == [Gift(1, (0, False), 0, False)]


FIRST, SECOND = Slot(0, 0, 0, 1, op=0, term=0), Slot(0, 0, 1, 2, op=0, term=1)
EMPTY = Slot(0, 0, 2, op=0)
HELD: tuple[Key, Key, Key] = ((9, False), (9, False), (9, False))


def given(
    slots: list[Slot],
    op: Op,
    *offers: Gift,
    wish: Callable[[int, Key], bool] = always,
    held: tuple[Key, Key, Key] = HELD,
) -> str:
    """What each slot captures, as i, f, n."""
    registers: list[Key | None] = [*held]
    out = give(slots, op, offers, registers, wish)
    marks = [("i" * s.cap_index + "f" * s.cap_flag + "n" * s.cap_norm) or "-" for s in out]
    return " ".join(marks)


INDEX, FLAG, COUNT = (Gift(kind, (0, False), 0, False) for kind in range(3))


@pytest.mark.parametrize(
    ("op", "slots", "gift", "wanted"),
    [
        (PLAIN, [FIRST, SECOND], FLAG, "f -"),
        (FLAGGED, [FIRST, SECOND], FLAG, "- -"),
        (FLAGGED, [SECOND, FIRST], FLAG, "- f"),
        (FLAGGED, [SECOND, EMPTY, FIRST], FLAG, "- - f"),
        (FLAGGED, [FIRST, SECOND], COUNT, "n -"),
        (SCALED, [FIRST, SECOND], COUNT, "- -"),
        (SCALED, [SECOND, FIRST], COUNT, "- n"),
        (SCALED, [FIRST, SECOND], FLAG, "f -"),
        (PLAIN, [FIRST, EMPTY], FLAG, "f -"),
        (TABLE, [Slot(0, 0, 0, op=0, term=0)], INDEX, "i"),
        (CHOICE, [Slot(0, 0, 0, 1, op=0, term=0)], FLAG, "-"),
        (ROOT, [Slot(0, 0, 0, 1, op=0, term=0)], COUNT, "-"),
    ],
)
def test_what_the_ops_own_terms_use_stays(
    op: Op, slots: list[Slot], gift: Gift, wanted: str
) -> None:
    """An index may replace what the capturing slot itself uses, a flag or a count may not."""
    assert given(slots, op, gift) == wanted


def test_what_is_held_is_not_captured_again() -> None:
    assert given([FIRST, SECOND], PLAIN, FLAG, held=(HELD[0], (0, False), HELD[2])) == "- -"


def test_no_capture_before_another_of_its_kind() -> None:
    late, early = Gift(1, (1, False), 1, False), FLAG
    assert given([FIRST, SECOND], PLAIN, late, early) == "- f"
    assert given([SECOND, FIRST], PLAIN, late, early) == "f f"
    # What is refused leaves the way to what comes behind it.
    assert given([FIRST, SECOND], PLAIN, late, early, wish=lambda _, key: key[0] == 0) == "f -"
    assert given([FIRST, SECOND], FLAGGED, early, COUNT) == "n -"


@pytest.mark.parametrize("kind", ["cap_index", "cap_flag", "cap_norm"])
def test_operands_are_exchanged_unless_a_capture_holds_them(kind: str) -> None:
    gift, back = Gift(0, (1, False), 0, True), Gift(0, (0, False), 0, False)
    if kind == "cap_index":
        gift, back = replace(gift, kind=1), replace(back, kind=1)
    registers: list[Key | None] = [None, None, None]
    (slot,) = give([FIRST], PLAIN, [gift], registers, always)
    assert (slot.a, slot.b, slot.swap) == (1, 0, True) and registers[gift.kind] == (1, False)
    (slot,) = give(
        [replace(slot, cap_index=False, cap_flag=False)], PLAIN, [back], [None] * 3, always
    )
    assert (slot.a, slot.b, slot.swap) == (0, 1, False)
    assert given([replace(FIRST, **{kind: True})], PLAIN, gift) == kind[4]  # type: ignore[arg-type]
    assert given([replace(FIRST, **{kind: True})], PLAIN, back) != kind[4]  # type: ignore[arg-type]


def test_a_quarter_is_of_index_and_flag_alone() -> None:
    """A slot adds it, or does not, to both; to a count never."""
    angle = Gift(0, (0, True), 0, False)
    for offers, wanted in (
        ([angle, FLAG], (True, False, False, True)),
        ([FLAG, angle], (False, True, False, False)),
        ([COUNT, angle], (True, False, True, True)),
        ([angle, COUNT], (True, False, True, True)),
        ([replace(FLAG, key=(0, True)), angle], (True, True, False, True)),
        ([COUNT], (False, False, True, False)),
    ):
        (slot,) = give([FIRST], PLAIN, offers, [None, None, None], always)
        assert (slot.cap_index, slot.cap_flag, slot.cap_norm, slot.quarter) == wanted
