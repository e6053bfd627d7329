"""Longest paths and lower bounds, counted by hand."""

from __future__ import annotations

from typing import Any

import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.priorities import paths, slots_after, topological
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value, When

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]
PLAIN, IF, UNLESS = Term(0, 1, 23), Term(2, 3, 23, when=When.IF), Term(0, 2, 23, when=When.UNLESS)
SCALED, TABLE, SLOPE = Term(2, 3, 23, scale=Scale.HALF), Term(1, None, 23, 0), Term(0, None, 23, 1)


@pytest.mark.parametrize(
    ("terms", "captures", "value", "delay", "wanted"),
    [
        ((PLAIN, UNLESS), {}, 1, 1, 1),
        ((PLAIN, Term(0, 2, 23)), {}, 0, 1, 2),
        # A flag or a count: with the first term that uses it, or in a slot of its own.
        ((PLAIN, IF), {"flag": 2}, 2, 1, 1),
        ((PLAIN, IF), {"flag": 5}, 5, 1, 2),
        ((IF, UNLESS), {"flag": 5}, 5, 1, 3),
        ((PLAIN, IF), {"flag": 0}, 0, 1, 2),
        ((PLAIN, SCALED), {"norm": 3}, 3, 1, 1),
        ((PLAIN, SCALED), {"norm": 5}, 5, 1, 2),
        ((IF, SCALED), {"flag": 5, "norm": 5}, 5, 1, 3),
        # An index: strictly before what looks it up, by the delay.
        ((TABLE, SLOPE), {"index": 0}, 0, 1, 3),
        ((TABLE, SLOPE), {"index": 0}, 0, 2, 4),
        ((TABLE, SLOPE), {"index": 0}, 1, 2, 1),
        ((TABLE, PLAIN), {"index": 0}, 0, 1, 2),
        ((TABLE, PLAIN), {"index": 0}, 0, 2, 3),
        ((TABLE, IF), {"index": 5, "flag": 5}, 5, 1, 3),
        # What no term uses is not captured.
        ((PLAIN,), {"index": 5, "flag": 5, "norm": 5}, 5, 3, 1),
    ],
)
def test_slots_after_a_value(
    terms: tuple[Term, ...], captures: dict[str, Any], value: int, delay: int, wanted: int
) -> None:
    assert slots_after(Op(9, terms, table=0, **captures), value, delay) == wanted


def program(
    ops: tuple[Op, ...], inputs: tuple[int, ...], outputs: tuple[int, ...], params: int = 0
) -> Program:
    """Inputs, then parameters, then what the ops make."""
    kinds = [Kind.INPUT] * len(inputs) + [Kind.PARAM] * params + [Kind.OP] * len(ops)
    values = tuple(Value(f"x{k}", kind, 31, -1, 1, "test") for k, kind in enumerate(kinds))
    names = tuple(f"x{n}" for n in outputs)
    return Program("p", Arithmetic(), values, ops, inputs, outputs, names, (), ())


@pytest.mark.parametrize("machine", [SMALL, FAST])
def test_a_product_and_its_square(machine: Any) -> None:
    """The inputs are read from cycles 1 and 2 on; the last emit is that of the square."""
    p = program((Op(2, (PLAIN,)), Op(3, (Term(2, 2, 23),))), (0, 1), (2, 3))
    delay, read = machine.latency, machine.stages.read
    both = paths(p, machine, 2)
    assert both.urgent == (2 * delay, delay, 1, 0)
    assert both.total == (2 * delay + read + 1, delay + read + 1, read + 2, read + 1)
    assert both.slots == (1, 1, 0, 1)
    assert both.latency_bound == 2 + 2 * delay + read + 1
    assert both.length_bound == 2 + 2 * delay + read + 1
    first = paths(p, machine, 1)
    assert first.urgent == (delay, None, 0, None) and first.total == both.total
    assert first.latency_bound == 2 + delay + read + 1
    assert first.length_bound == both.length_bound
    none = paths(p, machine, 0)
    assert none.urgent == (None,) * 4 and none.length_bound == both.length_bound
    assert none.latency_bound == read + 1


def test_a_slot_for_each_term() -> None:
    """Of parameters alone, which are there from cycle 0 on; with the square after its flag."""
    three = Op(2, (Term(0, 0, 23), PLAIN, Term(1, 1, 23)))
    chosen = Op(3, (Term(0, 0, 23, when=When.IF), Term(1, 1, 23, when=When.IF)), flag=2)
    p = program((three, chosen), (), (3,), params=2)
    delay, read = SMALL.latency, SMALL.stages.read
    result = paths(p, SMALL, 1)
    assert result.slots == (3, 2, 1)
    assert result.urgent == (delay + 2 + delay, delay, 0)
    assert result.latency_bound == 2 + (delay + 2 + delay) + read + 1


@pytest.mark.parametrize("machine", [SMALL, FAST])
@pytest.mark.parametrize("urgent", [20, 30])
@pytest.mark.parametrize("apart", [False, True])
def test_lanes_are_full(machine: Any, urgent: int, apart: bool) -> None:
    """As many slots as terms and emits, and one for a flag that no term reads."""
    terms = tuple(Term(0, 1, 23, when=When.IF) for _ in range(3))
    flag = 2 if apart else 1
    ops = tuple(Op(3 + k, terms, flag=flag) for k in range(30))
    result = paths(program(ops, (), tuple(range(3, 33)), params=3), machine, urgent)
    slots = 4 * urgent + apart
    assert result.latency_bound == -(-slots // machine.lanes) - 1 + machine.stages.read + 1
    assert result.length_bound == -(-(4 * 30 + apart) // machine.lanes) + 1


def test_the_inputs_take_a_cycle_each() -> None:
    """Here longer than what is computed from the second of them."""
    result = paths(program((), tuple(range(40)), (1,)), SMALL, 1)
    assert (result.slots, result.length_bound) == ((1,), 40)
    read = SMALL.stages.read
    few = paths(program((), (0, 1), (1,)), SMALL, 1)
    assert few.length_bound == few.latency_bound == 2 + read + 1
    none = paths(program((), (), (0,), params=1), SMALL, 1)
    assert none.length_bound == none.latency_bound == read + 1


def test_what_is_no_output_is_written_too() -> None:
    result = paths(program((Op(2, (PLAIN, PLAIN)),), (), (), params=2), SMALL, 0)
    assert result.length_bound == 1 + SMALL.latency


def test_order_of_what_is_read() -> None:
    late, early = Op(2, (Term(3, 0, 23),)), Op(3, (Term(0, 1, 23),))
    other = Op(4, (Term(0, 0, 23, when=When.IF),), flag=2)
    assert topological(program((other, late, early), (0, 1), (4,))) == [2, 1, 0]
    with pytest.raises(ScheduleError, match=r"^p: op x2 waits for itself or for a value that is"):
        topological(program((early, Op(2, (Term(2, 0, 23),))), (0, 1), ()))
