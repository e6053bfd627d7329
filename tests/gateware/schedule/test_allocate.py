"""Registers of random schedules."""

from __future__ import annotations

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.schedule.allocate import allocate, allocate_together
from boresight.gateware.schedule.scheduler import Schedule, ScheduleError, schedule
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value
from tests.support.crowded_program import crowded_program
from tests.support.random_program import random_program

MACHINES = pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)


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


@MACHINES
def test_tenants_do_not_overlap(machine: Machine) -> None:
    for seed in range(12):
        s = schedule(random_program(seed, n_ops=60), machine, restarts=0)
        seen: dict[int, list[tuple[int, int]]] = {}
        for t in allocate(s).live_ranges:
            if s.program.values[t.value].kind is Kind.CONST:
                continue
            spans = seen.setdefault(t.address, [])
            assert all(
                t.start > end + 1 or start > t.end + 1 or end < t.start for start, end in spans
            )
            spans.append((t.start, t.end))


@MACHINES
def test_registers_are_reused(machine: Machine) -> None:
    p = random_program(2, n_ops=100, recent=0.9)
    a = allocate(schedule(p, machine, restarts=0))
    assert sum(lower for lower, _ in a.used(machine)) < 100


@MACHINES
def test_parameters_come_first(machine: Machine) -> None:
    s = schedule(wide(params=5), machine, restarts=0)
    where = allocate(s).addresses()
    assert [where[n] for n in range(1, 6)] == [0, 1, 2, 3, 4]
    many = wide(params=60)  # more than there are in one of two banks
    s = schedule(many, machine, restarts=0)


@MACHINES
def test_states_are_paired(machine: Machine) -> None:
    s = schedule(wide(states=9), machine, restarts=0)
    a = allocate(s)
    where = a.addresses()
    for state, after in s.program.states:
        c = machine.bank_depth // 4
        assert where[state] & (machine.bank_depth // 2)
        assert not where[state] & c
        assert where[after] == where[state] | c
        assert a.initial[where[state]] == a.initial[where[after]] == s.program.values[state].initial


@MACHINES
def test_what_outlives_a_step_is_there_to_its_last_cycle(machine: Machine) -> None:
    """From the first one on; what comes or is computed, from behind its write."""
    s = schedule(wide(params=2, states=3), machine, restarts=0)
    last, program = s.length - 1, s.program
    span = {t.value: (t.start, t.end) for t in allocate(s).live_ranges}
    kinds = (Kind.PARAM, Kind.CONST, Kind.STATE)
    assert all(span[n] == (0, last) for n, v in enumerate(program.values) if v.kind in kinds)
    assert all(span[after][1] == last for after in _makers(s).values())
    born = [*zip(program.streamed, s.gets, strict=True)]
    born += [(op.dest, s.write_cycle(k)) for k, op in enumerate(program.ops)]
    assert [span[n][0] for n, _ in born] == [written + 1 for _, written in born]


@MACHINES
def test_equal_constants_share(machine: Machine) -> None:
    p = wide(consts=3)
    same = [
        v if v.kind is not Kind.CONST else Value(v.name, v.kind, 30, 0, 1, "test", initial=7)
        for v in p.values
    ]
    equal = Program(
        "same",
        p.arithmetic,
        tuple(same),
        *(
            getattr(p, n)
            for n in ("ops", "inputs", "outputs", "output_names", "states", "table_memory")
        ),
    )
    s = schedule(equal, machine)
    a = allocate(s)
    where = a.addresses()
    assert len({where[1], where[2], where[3]}) == 1


def test_negative_words_are_unsigned() -> None:
    machine = CONFIGS["small"]
    p = random_program(3)
    s = schedule(p, machine, restarts=0)
    assert all(0 <= w < 1 << 32 for w in allocate(s).initial)


def test_full() -> None:
    small, fast = CONFIGS["small"], CONFIGS["fast"]
    with pytest.raises(
        ScheduleError,
        match=r"^wide: 256 constants, \d+ registers of the small "
        r"machine left for them; config small-1024 has more$",
    ):
        allocate(schedule(wide(consts=256), small, restarts=0))
    with pytest.raises(
        ScheduleError,
        match=r"^wide: 257 constants and 0 parameters, the small machine has 256 registers for "
        r"them; config small-1024 has more$",
    ):
        schedule(wide(consts=257), small, restarts=0)
    with pytest.raises(
        ScheduleError,
        match=r"^wide: parameters need 129 registers of bank 1, the "
        r"fast machine has 128 for them; config fast-1024 has more$",
    ):
        allocate(schedule(wide(params=177), fast, restarts=0))
    many = schedule(wide(states=65), small, restarts=0)
    with pytest.raises(
        ScheduleError,
        match=r"^wide: states need 130 registers of bank 0, the "
        r"small machine has 128 for them; config small-1024 has more$",
    ):
        allocate_together([many, many])
    values = tuple(Value(f"p{k}", Kind.PARAM, 31, -1, 1, "test") for k in range(300))
    addressed = Program("many", Arithmetic(), values, (), (), (), (), (), ())
    with pytest.raises(
        ScheduleError,
        match=r"^many: parameters need 513 registers of bank 0, the small-1024 machine has 512 for "
        r"them; the bus has no more addresses$",
    ):
        allocate_together([schedule(addressed, ALL_CONFIGS["small-1024"], restarts=0)] * 2)


@pytest.mark.parametrize(("results", "guests"), [(250, 0), (251, 61)])
def test_the_last_register_of_the_lower_half(results: int, guests: int) -> None:
    """With it, no result need live where next states are; with one result more, those do."""
    s = schedule(crowded_program(results=results, constants=3), CONFIGS["small"], restarts=0)
    a = allocate(s)
    where = [*a.addresses().values()]
    nexts = {a.addresses()[after] for _, after in s.program.states}
    assert sum(n in nexts for n in where) - len(nexts) == guests
    assert (a.used(s.machine)[0][0] == 256) is (guests == 0)


@MACHINES
def test_results_live_where_next_states_are_yet_to_be_written(machine: Machine) -> None:
    s = schedule(crowded_program(), machine, restarts=0)
    a = allocate(s)
    where, depth = a.addresses(), machine.bank_depth
    nexts = {where[after]: s.write_cycle(k) for k, after in _makers(s).items()}
    guests = [t for t in a.live_ranges if t.address in nexts and t.value not in _makers(s).values()]
    assert len(guests) >= 20
    assert all(t.end < nexts[t.address] for t in guests)
    below = {t.address for t in a.live_ranges if t.address % depth < depth // 2}
    assert len(below) <= depth // 2 * machine.lanes
    # Where the lower half suffices, no register of the upper one is used.
    few = schedule(crowded_program(results=60), machine, restarts=0)
    used = allocate(few).addresses()
    taken = [used[after] for _, after in few.program.states]
    assert len([n for n in used.values() if n in taken]) == len(taken)
    # So too where only the bank of the inputs is too small.
    many = crowded_program(inputs=140, results=4, constants=3)
    allocate(schedule(many, machine, restarts=0))
    # And next states are not enough for everything.
    wanted = r"^crowded: \d+ constants, \d+ registers of the \w+ machine left for them; config \S+"
    with pytest.raises(ScheduleError, match=wanted):
        allocate(schedule(crowded_program(constants=240), machine, restarts=0))
    wanted = (
        r"^crowded: parameters, inputs and results need \d+ registers of bank 0, the \w+ machine"
    )
    with pytest.raises(ScheduleError, match=wanted):
        allocate(schedule(crowded_program(inputs=300, constants=3), machine, restarts=0))


def _makers(s: Schedule) -> dict[int, int]:
    """Op and value of each next state."""
    producer = {op.dest: k for k, op in enumerate(s.program.ops)}
    return {producer[after]: after for _, after in s.program.states}
