"""What a schedule says of itself, counted by hand, and as JSON."""

import dataclasses

import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.slots import Schedule, ScheduleError, Slot
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value

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
