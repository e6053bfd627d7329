"""Schedules of random and of known programs."""

from __future__ import annotations

import dataclasses

import pytest

from boresight.gateware.core import ScheduleError, schedule, state_quotas
from boresight.gateware.machine import CONFIGS, Machine
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value
from tests.support.random_program import random_program

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]
ONE = 1 << 30


def program(
    ops: list[Op],
    outputs: list[int],
    *,
    inputs: int = 1,
    states: tuple[tuple[int, int], ...] = (),
    more: tuple[Value, ...] = (),
) -> Program:
    """Values: inputs, then the constant one, then ``more``, then one for each op."""
    values = [Value(f"in{k}", Kind.INPUT, 31, -1, 1, "test") for k in range(inputs)]
    values += [Value("one", Kind.CONST, 30, 1, 1, "test", initial=ONE), *more]
    values += [Value(f"v{k}", Kind.OP, 31, -1, 1, "test") for k in range(len(ops))]
    return Program(
        "test",
        Arithmetic(),
        tuple(values),
        tuple(ops),
        tuple(range(inputs)),
        tuple(outputs),
        tuple(f"o{k}" for k in outputs),
        states,
        tuple(k % 1000 for k in range(1536)),
    )


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_one_op(machine: Machine) -> None:
    """get in cycle 0, read in 1, written in 7, emitted at 8 + 1, counted: 10."""
    p = program([Op(2, (Term(0, 1, 22),))], [2])
    s = schedule(p, machine)
    assert s.latencies == (10,)
    assert s.length == s.interval == 10
    assert s.latency == 10


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_late_operand_comes_last(machine: Machine) -> None:
    """The slots on early operands hide behind the wait for the late one."""
    p = program(
        [Op(2, (Term(0, 1, 22),)), Op(3, (Term(2, 1, 22), Term(0, 0, 22), Term(0, 1, 22)))], [3]
    )
    s = schedule(p, machine)
    assert s.latencies == (17,)


def test_small_fills_its_lane() -> None:
    """Bound by slots, one lane is busy all the time but for the last pipeline."""
    for seed in range(4):
        p = random_program(seed, n_ops=120, n_inputs=10, n_outputs=7, n_states=8, recent=0.2)
        s = schedule(dataclasses.replace(p, urgent=4), SMALL)
        assert sum(slot.lane == 0 for slot in s.slots) > 0.96 * s.length


def test_urgent_outputs_come_first() -> None:
    p = random_program(5, n_ops=100, n_inputs=8, n_outputs=8, n_states=4, recent=0.2)
    some, every = (schedule(dataclasses.replace(p, urgent=u), SMALL) for u in (2, 8))
    assert some.latency <= 1.04 * every.latencies[1]
    assert every.latency <= 1.01 * some.latencies[7]


def test_errors() -> None:
    p = random_program(1, n_ops=30)
    with pytest.raises(
        ScheduleError,
        match=r"^random_1_32_30: program takes \d+ microwords or more, the "
        r"fast machine has 16; compute less in an update$",
    ):
        schedule(p, dataclasses.replace(FAST, rom_words=16))


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("counts", [(128,), (1, 1, 1), (16, 20, 45, 47), (1, 126, 1), (3, 0, 5, 7)])
def test_state_quotas(config: str, counts: tuple[int, ...]) -> None:
    """Every program has room for its states, and no bank is full before all have it."""
    machine, p = CONFIGS[config], random_program(1, n_ops=1, n_states=1)
    quotas = state_quotas([dataclasses.replace(p, states=p.states * n) for n in counts], machine)
    assert all(sum(quota) >= count for quota, count in zip(quotas, counts, strict=True))
    assert all(sum(each) <= machine.state_slots for each in zip(*quotas, strict=True))
