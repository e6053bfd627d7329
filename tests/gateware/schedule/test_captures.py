"""Captures that ride on other ops' slots."""

from __future__ import annotations

from boresight.gateware.schedule.captures import Key, gifts, give, keys
from boresight.gateware.schedule.slots import Slot
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value, When

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
    assert keys(SQUARE) == (None, None, None)
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
    one, slope = Slot(0, 0, 1, op=0, term=0), Slot(0, 0, 0, op=0, term=1)
    held: list[Key | None] = [(0, False), None, None]
    out = give([one, slope], TABLE, offers[0], held, always)
    assert [s.cap_index for s in out] == [False, True]
    assert held[0] == (0, True)
    held = [(0, False), None, None]
    out = give([slope, one], TABLE, offers[0], held, always)
    assert [s.cap_index for s in out] == [False, False]


def test_only_what_is_wished() -> None:
    offers = gifts(program(SQUARE, TABLE, CHOICE))
    held: list[Key | None] = [None, None, None]
    (slot,) = give(
        [Slot(0, 0, 0, 0, op=0, term=0)], SQUARE, offers[0], held, lambda kind, key: kind == 1
    )
    assert (slot.cap_index, slot.cap_flag) == (False, True)
