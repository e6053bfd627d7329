"""Slots: order, copies, what a schedule reports; the search's normal deviates."""

import dataclasses
import random
import statistics
from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.arrange import IDLE, _topological, arrangements, needs, reads
from boresight.gateware.schedule.copies import copy_shift, with_copies
from boresight.gateware.schedule.deviates import Deviates
from boresight.gateware.schedule.slots import Schedule, ScheduleError, Slot
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Negate, Op, Program, Scale, Term, Value, When
from tests.support.random_program import random_inputs, random_program

# -- slots of one op: captures, order, swaps ------------------------------------------------------

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


@pytest.mark.parametrize("quarter", [False, True])
def test_one_dummy_for_two_captures_of_a_value(quarter: bool) -> None:
    terms = (Term(0, None, 22, 1), Term(0, 1, 22, scale=Scale.FULL))
    op = Op(9, terms, norm=2, index=2, index_quarter=quarter, table=0)
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


def test_the_shortest_come_first() -> None:
    for k, op in enumerate(random_program(1).ops):
        lengths = [len(x.slots) for x in arrangements(op, k, needs(op))]
        assert lengths == sorted(lengths)


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
    op = Op(9, (Term(0, 1, 22, negate=Negate.UNLESS), Term(2, 3, 22)), flag=1)
    shortest = arrangements(op, 0, needs(op))[0]
    assert [(s.a, s.b, s.swap, s.cap_flag) for s in shortest.slots] == [
        (1, 0, True, True),
        (2, 3, False, False),
    ]


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


def test_one_slot_waits_for_both_operands() -> None:
    (x,) = arrangements(Op(9, (Term(0, 1, 22),)), 0, NOTHING)
    assert x.place([5, 7]) == x.place([7, 5]) == (7, [0])
    assert x.reads == ((0, 1),) and not x.slots[0].swap


LOOKED_UP, FILL = Term(0, None, 22, 1), Term(0, 1, 22)
CHOSEN = Term(0, None, 22, 1, when=When.IF)


@pytest.mark.parametrize(
    ("terms", "captures", "delay", "late", "wanted"),
    [
        # Terms that wait for nothing go between, what is missing stays idle.
        ((LOOKED_UP,), {"index": 5}, 1, None, (0, [1, 0])),
        ((LOOKED_UP,), {"index": 5}, 2, None, (0, [1, IDLE, 0])),
        ((LOOKED_UP, FILL, FILL), {"index": 5}, 2, None, (0, [1, 3, 2, 0])),
        ((LOOKED_UP, FILL, FILL), {"index": 5}, 4, None, (0, [3, 1, 2, IDLE, 0])),
        ((LOOKED_UP, FILL), {"index": 0}, 2, None, (0, [1, IDLE, 0])),
        # What waits is what uses the capture; of an index, longer by the delay.
        ((LOOKED_UP, FILL), {"index": 5}, 1, 5, (9, [1, 2, 0])),
        ((FILL, replace(FILL, scale=Scale.HALF)), {"norm": 5}, 1, 5, (9, [0, 2, 1])),
        ((CHOSEN,), {"index": 5, "flag": 6}, 2, 6, (9, [1, 2, 0])),
        ((CHOSEN,), {"index": 5, "flag": 6}, 3, 6, (9, [1, 2, IDLE, 0])),
        ((CHOSEN,), {"index": 5, "flag": 0}, 2, None, (0, [1, IDLE, 0])),
        (
            (LOOKED_UP, replace(FILL, when=When.IF)),
            {"index": 5, "flag": 5},
            3,
            5,
            (10, [2, 1, IDLE, 0]),
        ),
    ],
)
def test_captures_come_before_what_uses_them(
    terms: tuple[Term, ...],
    captures: dict[str, int],
    delay: int,
    late: int | None,
    wanted: tuple[int, list[int]],
) -> None:
    op = Op(9, terms, table=0, **captures)  # type: ignore[arg-type]
    best = arrangements(op, 0, needs(op))[0]
    assert best.place([10 * (v == late) for v in range(7)], delay) == wanted


def test_captures_that_are_held_delay_nothing() -> None:
    terms = (replace(CHOSEN, scale=Scale.HALF), FILL)
    (x,) = arrangements(Op(9, terms, index=5, flag=5, norm=5, table=0), 0, NOTHING)
    assert x.place([0] * 6, 3) == (0, [0, 1])


def test_an_idle_slot_reads_what_the_one_before_it_does() -> None:
    op = Op(9, (LOOKED_UP,), index=5, table=0)
    (x,) = arrangements(op, 7, needs(op))
    slots = x.ordered([1, IDLE, 0])
    assert [(s.a, s.op, s.cap_index, s.term) for s in slots] == [
        (5, 7, True, None),
        (5, 7, False, None),
        (0, 7, False, 0),
    ]


def test_edges_come_after_those_into_their_tails() -> None:
    chain = [(3, 1), (1, 0), (0, 2), (3, 0)]
    ordered = _topological(4, chain)
    assert ordered is not None and sorted(ordered) == sorted(chain)
    for k, (tail, _) in enumerate(ordered):
        assert all(head != tail for _, head in ordered[k:])
    assert _topological(3, [(0, 1), (1, 2), (2, 0)]) is None


# -- copies change nothing but where the next states come from ------------------------------------


@pytest.mark.parametrize("seed", range(20))
def test_equals_the_source(seed: int) -> None:
    p = random_program(seed, n_states=6)
    low = with_copies(p)
    assert len({after for _, after in low.states}) == len(low.states)
    assert all(low.values[after].kind is Kind.OP for _, after in low.states)
    assert len({v.name for v in low.values}) == len(low.values)
    source, copied = Interpreter(p), Interpreter(low)
    for words in random_inputs(p, seed, 8):
        column = np.array(words)[:, None]
        for a, b in zip(source.update(column), copied.update(column), strict=True):
            assert (a == b).all()


def test_nothing_to_copy() -> None:
    p = random_program(0, n_states=0)
    assert with_copies(p) == p


def test_copy_shift() -> None:
    arith = Arithmetic()
    assert copy_shift(1 << 8, arith) == 0
    assert copy_shift(1 << 30, arith) == 22
    for word in (0, 1, 1 << 7, 3 << 8, -(1 << 31), 1 << 31):
        assert copy_shift(word, arith) is None


# -- what a schedule says of itself, counted by hand, and as JSON ---------------------------------

FAST = CONFIGS["fast"]
PROGRAM = Program(
    "two",
    Arithmetic(),
    (
        Value("x", Kind.INPUT, 31, -1, 1, "test"),
        Value("one", Kind.CONST, 30, 1, 1, "test", initial=1 << 30),
        Value("y", Kind.OP, 31, -1, 1, "test"),
    ),
    (Op(2, (Term(0, 1, 22), Term(0, 0, 22))),),
    (0,),
    (2, 0),
    ("y", "x"),
    (),
    (),
)
PLAN = Schedule(
    program=PROGRAM,
    source="digest",
    machine=FAST,
    slots=(
        Slot(1, 1, 0, 1, op=0, term=0, first=True),
        Slot(2, 0, 0, emit=1),
        Slot(2, 1, 0, 0, op=0, term=1, last=True),
        Slot(9, 1, 2, emit=0),
    ),
    gets=(0,),
    length=12,
    urgent=1,
)


def test_times() -> None:
    """The word of a slot that emits leaves a cycle after its operands are read; both counted."""
    assert PLAN.latencies == (11, 4)
    assert PLAN.latency == 11 and dataclasses.replace(PLAN, urgent=2).latency == 4
    assert dataclasses.replace(PLAN, urgent=0).latency == 0
    assert PLAN.interval == 12
    assert PLAN.ends == {0: PLAN.slots[2]}
    assert PLAN.write_cycle(0) == 2 + 6
    assert PLAN.lane_use == (1 / 12, 3 / 12)


def test_json() -> None:
    text = PLAN.to_json()
    assert Schedule.from_json(text, FAST) == PLAN
    assert dataclasses.replace(PLAN).to_json() == text
    with pytest.raises(ScheduleError, match=r"^machine must be 'fast', not 'small'$"):
        Schedule.from_json(text, CONFIGS["small"])


# -- normal deviates: those of the standard library, but for their last bits ----------------------


def test_the_same_as_the_librarys() -> None:
    ours, theirs = random.Random(7), random.Random(7)
    deviates = Deviates(ours)
    for k in range(2000):
        if k % 3 == 0:  # uniform numbers in between belong to the same sequence
            assert ours.random() == theirs.random()
        size = (2.0, 5.0, 12.0)[k % 3]
        assert deviates.draw(size) == pytest.approx(theirs.gauss(0.0, size), rel=1e-12, abs=1e-13)


def test_they_are_normal() -> None:
    deviates = Deviates(random.Random(1))
    drawn = [deviates.draw(3.0) for _ in range(20_000)]
    assert abs(statistics.fmean(drawn)) < 0.1
    assert abs(statistics.stdev(drawn) - 3.0) < 0.06
    assert abs(sum(x < 3.0 for x in drawn) / 20_000 - 0.8413) < 0.01
