"""Registers of random schedules."""

from __future__ import annotations

import pytest

from boresight.gateware.core import ScheduleError, build_core, schedule
from boresight.gateware.machine import ALL_CONFIGS, CONFIGS
from boresight.gateware.schedule.allocate import allocate_together
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value
from tests.support.crowded_program import crowded_program


def wide(*, consts: int = 1, params: int = 0, states: int = 0) -> Program:
    """One op per constant and parameter, all different; states that stay."""
    arith = Arithmetic()
    values = [Value("in", Kind.INPUT, 31, -1, 1, "test")]
    values += [Value(f"p{k}", Kind.PARAM, 31, -1, 1, "test") for k in range(params)]
    values += [Value(f"c{k}", Kind.CONST, 31, -1, 1, "test", initial=k + 1) for k in range(consts)]
    values += [Value(f"s{k}", Kind.STATE, 31, -1, 1, "test", initial=k) for k in range(states)]
    used = [n for n, v in enumerate(values) if v.kind in (Kind.PARAM, Kind.CONST)]
    ops = []
    for k, n in enumerate(used):
        values.append(Value(f"v{k}", Kind.OP, 31, -1, 1, "test"))
        ops.append(Op(len(values) - 1, (Term(0, n, 23),)))
    stay = tuple((n, n) for n, v in enumerate(values) if v.kind is Kind.STATE)
    return Program(
        "wide", arith, tuple(values), tuple(ops), (0,), (len(values) - 1,), ("o",), stay, ()
    )


def test_full() -> None:
    small, fast = CONFIGS["small"], CONFIGS["fast"]
    with pytest.raises(
        ScheduleError,
        match=r"^wide: 256 constants, \d+ registers of the small "
        r"machine left for them; config small-1024 has more$",
    ):
        allocate_together([schedule(wide(consts=256), small)])
    with pytest.raises(
        ScheduleError,
        match=r"^wide: parameters need 129 registers of bank 1, the "
        r"fast machine has 128 for them; config fast-1024 has more$",
    ):
        allocate_together([schedule(wide(params=177), fast)])
    values = tuple(Value(f"p{k}", Kind.PARAM, 31, -1, 1, "test") for k in range(300))
    addressed = Program("many", Arithmetic(), values, (), (), (), (), (), ())
    with pytest.raises(
        ScheduleError,
        match=r"^many: parameters need 600 registers of bank 0, the small-1024 machine has 512 for "
        r"them; the bus has no more addresses$",
    ):
        allocate_together([schedule(addressed, ALL_CONFIGS["small-1024"])] * 2)


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize(
    "sizes", [{}, {"results": 60}, {"inputs": 140, "results": 4, "constants": 3}]
)
def test_results_use_registers_of_next_states(config: str, sizes: dict[str, int]) -> None:
    """Where the lower halves of the banks are too small; the core is proven when it is built."""
    core = build_core(crowded_program(**sizes), config)
    where = core.allocation.addresses
    next_states = {where[after] for _, after in core.schedule.program.states}
    shared = sum(register in next_states for register in where.values()) - len(next_states)
    assert sizes.get("results") != 60 or shared == 0
    assert sizes or shared >= 20


def test_no_room() -> None:
    machine = CONFIGS["fast"]
    wanted = r"^crowded: \d+ constants, \d+ registers of the \w+ machine left for them; config \S+"
    with pytest.raises(ScheduleError, match=wanted):
        allocate_together([schedule(crowded_program(constants=240), machine)])
    wanted = r"^crowded: parameters, inputs and results need \d+ registers of bank 0"
    with pytest.raises(ScheduleError, match=wanted):
        allocate_together([schedule(crowded_program(inputs=300, constants=3), machine)])
