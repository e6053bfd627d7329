"""Slots of one op: captures, order, swaps."""

from __future__ import annotations

import pytest

from boresight.gateware.schedule.arrange import _topological, arrangements, needs, reads
from boresight.model.words.program import Negate, Op, Scale, Term, When

FULL = (True, True, True)
NOTHING = (False, False, False)


def test_needs_are_those_of_the_terms() -> None:
    op = Op(9, (Term(0, 1, 22),), flag=2, norm=3, index=4)
    assert needs(op) == NOTHING
    assert reads(op) == {0, 1}
    op = Op(
        9,
        (Term(0, 1, 22, when=When.IF), Term(0, None, 22, 1), Term(0, 1, 22, scale=Scale.EVEN)),
        flag=2,
        norm=3,
        index=4,
        table=0,
    )
    assert needs(op) == FULL
    assert reads(op) == {0, 1, 2, 3, 4}


def test_late_operand_last() -> None:
    (x,) = arrangements(Op(9, (Term(0, 1, 22), Term(2, 3, 22))), 0, NOTHING)
    assert x.place({0: 10, 1: 0, 2: 0, 3: 0}) == (9, [1, 0])  # type: ignore[arg-type]


def test_one_dummy_for_two_captures_of_a_value() -> None:
    op = Op(9, (Term(0, None, 22, 1), Term(0, 1, 22, scale=Scale.FULL)), norm=2, index=2, table=0)
    shortest = arrangements(op, 0, needs(op))[0]
    assert len(shortest.slots) == 3
    dummy = shortest.slots[2]
    assert (dummy.term, dummy.a, dummy.cap_index, dummy.cap_norm) == (None, 2, True, True)


@pytest.mark.parametrize("quarter", [False, True])
def test_flag_and_index_of_one_angle_share_a_dummy(quarter: bool) -> None:
    op = Op(
        9,
        (Term(0, None, 22, 1, negate=Negate.IF),),
        flag=2,
        flag_quarter=quarter,
        index=2,
        index_quarter=quarter,
        table=0,
    )
    shortest = min(arrangements(op, 0, needs(op)), key=lambda x: len(x.slots))
    dummy = shortest.slots[1]
    assert len(shortest.slots) == 2 and dummy.a == 2 and dummy.quarter is quarter
    assert (dummy.cap_index, dummy.cap_flag) == (True, True)


def test_quarters_part_captures() -> None:
    op = Op(
        9, (Term(0, None, 22, 1, negate=Negate.IF),), flag=2, index=2, index_quarter=True, table=0
    )
    assert min(len(x.slots) for x in arrangements(op, 0, needs(op))) == 3


def test_index_comes_strictly_before() -> None:
    """The table's own slot reads x, but its index must be there already."""
    op = Op(9, (Term(0, None, 22, 1),), index=0, table=0)
    (x,) = arrangements(op, 0, needs(op))
    assert len(x.slots) == 2
    assert x.place([5]) == (5, [1, 0])


def test_flag_rides_on_port_b_by_swapping() -> None:
    op = Op(9, (Term(0, 1, 22, negate=Negate.UNLESS),), flag=1)
    shortest = arrangements(op, 0, needs(op))[0]
    assert [(s.a, s.b, s.swap, s.cap_flag) for s in shortest.slots] == [(1, 0, True, True)]


def test_only_what_uses_a_capture_waits_for_it() -> None:
    """A late flag, count or index holds back the terms that use it, and no other."""
    early, late = [0, 0, 10, 0], [0, 0, 0, 10]
    for options in (
        {"flag": 2, "terms": (Term(0, 1, 22), Term(2, 3, 22, when=When.IF))},
        {"norm": 2, "terms": (Term(0, 1, 22), Term(2, 3, 22, scale=Scale.HALF))},
    ):
        op = Op(9, **options)
        best = min(x.place(early) for x in arrangements(op, 0, needs(op)))
        assert best == (9, [0, 1])
    # Used by the first term too, the second one's operands decide.
    op = Op(9, (Term(0, 1, 22, when=When.IF), Term(2, 3, 22, when=When.IF)), flag=2)
    assert min(x.place(early) for x in arrangements(op, 0, needs(op)))[0] == 10
    # The flag in a slot of its own, then both.
    assert min(x.place(late) for x in arrangements(op, 0, needs(op)))[0] == 8


def test_edges_come_after_those_into_their_tails() -> None:
    chain = [(3, 1), (1, 0), (0, 2), (3, 0)]
    ordered = _topological(4, chain)
    assert ordered is not None and sorted(ordered) == sorted(chain)
    for k, (tail, _) in enumerate(ordered):
        assert all(head != tail for _, head in ordered[k:])
    assert _topological(3, [(0, 1), (1, 2), (2, 0)]) is None
