"""The checker of a core catches programs that touch each other's words."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import pytest

from boresight.gateware.core import build_shared_core
from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.schedule import check_core as module
from boresight.gateware.schedule.allocate import Allocation, allocate, allocate_together
from boresight.gateware.schedule.check_core import check_core
from boresight.gateware.schedule.links import Window
from boresight.gateware.schedule.search import schedule
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.estimator import Estimator, Input, Output
from boresight.model.words.program import Kind
from tests.support.linked import linked_core
from tests.support.random_program import random_programs
from tests.support.shared import STATES, Motion, Row, shared_core

MACHINES = pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)


def made(machine: Machine, seed: int = 3):
    programs = random_programs(seed, 2, n_states=3, n_ops=30)
    plans = [schedule(p, machine, restarts=0) for p in programs]
    return programs, plans, list(allocate_together(plans))


def moved(a: Allocation, old: int, new: int) -> Allocation:
    """Everything that lives in register ``old`` lives in ``new``."""
    return dataclasses.replace(
        a,
        live_ranges=tuple(
            dataclasses.replace(t, address=new) if t.address == old else t for t in a.live_ranges
        ),
    )


@MACHINES
def test_what_is_allocated_together_passes(machine: Machine) -> None:
    for seed in range(6):
        programs, plans, allocations = made(machine, seed)
        check_core(programs, plans, allocations)
    check_core(programs[:1], plans[:1], allocations[:1])  # the first one alone


@MACHINES
@pytest.mark.parametrize("kind", [Kind.CONST, Kind.PARAM])
@pytest.mark.parametrize("writer", [0, 1])
@pytest.mark.parametrize("what", [Kind.INPUT, Kind.OP])
def test_a_temporary_over_a_lasting_word(
    machine: Machine, kind: Kind, writer: int, what: Kind
) -> None:
    programs, plans, allocations = made(machine)
    mine, other = (allocations[k].addresses() for k in (writer, 1 - writer))
    states = {n for pair in plans[writer].program.states for n in pair}
    victim = next(
        n
        for n, v in enumerate(plans[writer].program.values)
        if v.kind is what and n in mine and n not in states and mine[n] < machine.bank_depth
    )
    lasting = next(
        other[n]
        for n in programs[1 - writer].of_kind(kind)
        if n in other and other[n] not in mine.values() and other[n] < machine.bank_depth
    )
    allocations[writer] = dataclasses.replace(
        allocations[writer],
        live_ranges=tuple(
            dataclasses.replace(t, address=lasting) if t.value == victim else t
            for t in allocations[writer].live_ranges
        ),
    )
    with pytest.raises(
        ScheduleError,
        match=rf"^random{writer} writes register {lasting}, which "
        rf"random{1 - writer} keeps a word in$",
    ):
        check_core(programs, plans, allocations)


@MACHINES
def test_states_in_the_same_registers(machine: Machine) -> None:
    programs, plans, allocations = made(machine)
    first, second = (a.addresses() for a in allocations)
    after = plans[1].program.states[0]
    bank = second[after[0]] // machine.bank_depth
    mine = next(
        (first[s] for s, _ in plans[0].program.states if first[s] // machine.bank_depth == bank),
        None,
    )
    if mine is None:
        pytest.skip("no state of the first program in that bank")
    a = moved(allocations[1], second[after[0]], mine)
    allocations[1] = moved(a, second[after[1]], mine + machine.bank_depth // 4)
    words = list(allocations[1].initial)
    with pytest.raises(ScheduleError, match=r"keeps a word in$|must start with the word of"):
        check_core(programs, plans, allocations)
    # Also where the first words happen to be equal.
    for offset in (0, machine.bank_depth // 4):
        words[mine + offset] = words[second[after[0]]]
    value = plans[0].program.find(
        next(
            plans[0].program.values[s].name for s, _ in plans[0].program.states if first[s] == mine
        )
    )
    equal = plans[1].program.values[after[0]].initial
    programs[0] = dataclasses.replace(
        programs[0],
        values=tuple(
            dataclasses.replace(v, initial=equal) if n == value else v
            for n, v in enumerate(programs[0].values)
        ),
    )
    plans[0] = schedule(programs[0], machine, restarts=0)
    allocations = [dataclasses.replace(a, initial=tuple(words)) for a in allocations]
    with pytest.raises(ScheduleError, match=r"^random1 writes register \d+, which random0 keeps"):
        check_core(programs, plans, allocations)


@MACHINES
@pytest.mark.parametrize("writer", [0, 1])
def test_only_the_two_copies_of_a_state_are_kept(machine: Machine, writer: int) -> None:
    """A word a quarter of the bank below a state, or above it but for the copy, is free."""
    programs, plans, allocations = made(machine)
    mine, other = (allocations[k].addresses() for k in (writer, 1 - writer))
    used = {*mine.values(), *other.values()}
    quarter = machine.bank_depth // 4
    moves = 0
    for state, _ in plans[1 - writer].program.states:
        free = other[state] - quarter
        bank = free // machine.bank_depth
        temporary = [
            n
            for n, v in enumerate(plans[writer].program.values)
            if v.kind in (Kind.INPUT, Kind.OP)
            and mine.get(n, -1) // machine.bank_depth == bank
            and mine[n] % machine.bank_depth < machine.bank_depth // 2
        ]
        if free in used or not temporary:
            continue
        moves += 1
        there = list(allocations)
        there[writer] = moved(allocations[writer], mine[temporary[0]], free)
        check_core(programs, plans, there)
    assert moves


@MACHINES
def test_the_second_program_alone(machine: Machine) -> None:
    """Allocated for itself its parameters are not where a second program's must be."""
    programs, plans, allocations = made(machine)
    assert programs[0].of_kind(Kind.PARAM) and programs[1].of_kind(Kind.PARAM)
    allocations[1] = allocate(plans[1])
    with pytest.raises(
        ScheduleError,
        match=r"^random1: parameter param0 must be in register \d+, "
        r"not 0$",
    ):
        check_core(programs, plans, allocations)
    with pytest.raises(ValueError, match="shorter"):  # what is left out has no proof
        check_core(programs, plans[:1], allocations[:1])


@MACHINES
def test_other_first_words(machine: Machine) -> None:
    programs, plans, allocations = made(machine)
    used = {t.address for a in allocations for t in a.live_ranges}
    words = list(allocations[1].initial)
    words[max(set(range(512)) - used)] ^= 1
    allocations[1] = dataclasses.replace(allocations[1], initial=tuple(words))
    with pytest.raises(
        ScheduleError,
        match=r"^random0 and random1 must share the machine and its "
        r"first words$",
    ):
        check_core(programs, plans, allocations)


def linked():
    """The parts of `linked_core`."""
    core = linked_core()
    programs = [p.program for p in core.parts]
    plans, allocations = [p.schedule for p in core.parts], [p.allocation for p in core.parts]
    return programs, plans, allocations, core.image.window


def test_links_pass() -> None:
    check_core(*linked())


def test_a_link_to_another_output() -> None:
    programs, plans, allocations, window = linked()
    outer, middle, inner = programs
    wrong = dataclasses.replace(outer.links[1], output="half")
    programs[0] = dataclasses.replace(outer, links=(outer.links[0], wrong))
    plans[0] = schedule(programs[0], plans[0].machine, restarts=0)
    results = list(allocate_together(plans))
    with pytest.raises(ScheduleError, match=r"^outer: product must be what keeps inner.half$"):
        check_core(programs, plans, results, window)


def test_a_link_to_itself() -> None:
    programs, plans, allocations, window = linked()
    outer = programs[0]
    links = tuple(dataclasses.replace(k, program="unknown") for k in outer.links)
    programs[0] = dataclasses.replace(outer, links=links)
    plans[0] = dataclasses.replace(
        plans[0],
        source=programs[0].digest,
        program=dataclasses.replace(plans[0].program, links=links),
    )
    with pytest.raises(ScheduleError, match=r"^outer: sum must be of another program, not of unk"):
        check_core(programs, plans, allocations, window)


def test_a_link_with_another_binary_point() -> None:
    programs, plans, allocations, window = linked()
    for k, of in enumerate((programs[0], plans[0].program)):
        values = list(of.values)
        number = of.links[0].value
        values[number] = dataclasses.replace(values[number], frac=values[number].frac - 1)
        changed = dataclasses.replace(of, values=tuple(values))
        if k:
            plans[0] = dataclasses.replace(plans[0], program=changed, source=programs[0].digest)
        else:
            programs[0] = changed
    with pytest.raises(ScheduleError, match=r"^outer: sum must be fixed<32,\d>, as its source$"):
        check_core(programs, plans, allocations, window)


@pytest.mark.parametrize("offset", [1, 128])
def test_a_link_to_another_register(offset: int) -> None:
    """The next slot, and the copy that is not the current one."""
    programs, plans, allocations, window = linked()
    number = programs[0].links[0].value
    old = allocations[0].addresses()[number]
    live_ranges = tuple(
        dataclasses.replace(t, address=old + offset) if t.value == number else t
        for t in allocations[0].live_ranges
    )
    allocations[0] = dataclasses.replace(allocations[0], live_ranges=live_ranges)
    with pytest.raises(ScheduleError, match=rf"^outer: sum must be read in register {old}, in the"):
        check_core(programs, plans, allocations, window)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"owners": (2, 1)}, "state sum.kept of middle stands in the window of inner"),
        ({"size": 128}, "state sum.kept of middle stands in the window of inner"),
        (None, "outer: sum must be read in register .*, in the window of middle"),
    ],
)
def test_another_window(change, message: str) -> None:
    programs, plans, allocations, window = linked()
    window = None if change is None else dataclasses.replace(window, **change)
    with pytest.raises(ScheduleError, match=f"^({message})"):
        check_core(programs, plans, allocations, window)


def test_a_reader_that_writes_what_it_reads() -> None:
    programs, plans, allocations, window = linked()
    number = programs[0].links[0].value
    address = allocations[0].addresses()[number]
    victim = next(op.dest for op in plans[0].program.ops)
    live_ranges = tuple(
        dataclasses.replace(t, address=address) if t.value == victim else t
        for t in allocations[0].live_ranges
    )
    allocations[0] = dataclasses.replace(allocations[0], live_ranges=live_ranges)
    with pytest.raises(ScheduleError, match=r"^outer"):
        check_core(programs, plans, allocations, window)


@MACHINES
def test_the_owner_of_every_state_register(machine: Machine) -> None:
    """Both copies of a slot, in every bank; `_owner` is asked of states only."""
    half, slots = machine.bank_depth // 2, machine.bank_depth // 4
    window = Window(8, (1, 0))
    for bank in range(machine.lanes):
        for copy in range(2):
            results = [
                module._owner(
                    bank * machine.bank_depth + half + copy * slots + slot, machine, window
                )
                for slot in range(slots)
            ]
            assert results == [None] * (slots - 8) + [1] * 4 + [0] * 4
    assert module._owner(half, machine, None) is None


@MACHINES
def test_both_copies_of_a_state_register(machine: Machine) -> None:
    """The registers of the upper half, which the parity selects; those below are single."""
    plan, half, slots = made(machine)[1][0], machine.bank_depth // 2, machine.bank_depth // 4
    for bank in range(machine.lanes):
        first = bank * machine.bank_depth
        assert module._pair(plan, first + half - 1) == {first + half - 1}
        for register in (first + half, first + half + slots - 1):
            both = {register, register + slots}
            assert all(module._pair(plan, r) == both for r in both)


# -- shared states ---------------------------------------------------------------------------------


def shared(made: Sequence[Estimator] = ()):
    """The parts of a core: a row, the owner of the states, one with its own."""
    core = build_shared_core([e.compile() for e in made], "small") if made else shared_core()
    return (
        [part.program for part in core.parts],
        [part.schedule for part in core.parts],
        [part.allocation for part in core.parts],
    )


def test_shared_states_pass() -> None:
    check_core(*shared())


def test_states_that_are_not_shared() -> None:
    """The same registers, but for a program that does not say so."""
    programs, plans, allocations = shared()
    programs[0] = dataclasses.replace(programs[0], shares="")
    with pytest.raises(ScheduleError, match=r"^motion writes register \d+, which row keeps a word"):
        check_core(programs, plans, allocations)


def test_shared_states_in_other_registers() -> None:
    """Two of them exchanged, which begin with the same word."""

    class Still(Motion):
        name = "motion"
        states = (STATES[0], dataclasses.replace(STATES[1], low=-8.0, high=8.0, initial=1.5))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"place": 0.5 * x.place + u.dt, "pace": 0.5 * x.pace}, {"place": x.place}

    class Same(Still):
        name, shares = "row", "motion"

    programs, plans, allocations = shared([Same(), Still()])
    where, slots = allocations[0].addresses(), plans[0].machine.state_slots
    a, b = (where[s] for s, _ in plans[0].program.states)
    spare = plans[0].machine.bank_depth * 5 // 8
    for old, new in ((a, spare), (b, a), (spare, b)):
        for offset in (0, slots):
            allocations[0] = moved(allocations[0], old + offset, new + offset)
    with pytest.raises(
        ScheduleError,
        match=r"^row must have the states of motion, in their .* and formats: place differs$",
    ):
        check_core(programs, plans, allocations)


@pytest.mark.parametrize("shorter", ["motion", "row"])
def test_a_shared_state_that_one_lacks(shorter: str) -> None:
    programs, plans, allocations = shared()
    number = [p.name for p in programs].index(shorter)
    low = plans[number].program
    low = dataclasses.replace(low, states=low.states[:-1])
    plans[number] = dataclasses.replace(plans[number], program=low)
    with pytest.raises(ScheduleError, match=r"^row must have the states .*: weight differs$"):
        module._check_families(programs, plans, allocations)


def test_a_shared_state_of_another_name() -> None:
    """It is named as the one calls it that does not own it."""
    programs, plans, allocations = shared()
    low = plans[0].program
    values = [
        dataclasses.replace(v, name={"place": "spot"}.get(v.name, v.name)) for v in low.values
    ]
    plans[0] = dataclasses.replace(plans[0], program=dataclasses.replace(low, values=tuple(values)))
    with pytest.raises(ScheduleError, match=r"^row must have the states of motion.*: spot differs"):
        module._check_families(programs, plans, allocations)


@pytest.mark.parametrize("source", ["motion", "row"])
def test_shared_states_are_read_by_no_other(source: str) -> None:
    class Reader(Estimator):
        inputs = (Input("z", -1.0, 1.0), Input("x", -8.0, 8.0, "m", source=f"{source}.place"))
        outputs = (Output("sum"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"sum": u.z + u.x}

    with pytest.raises(ScheduleError, match=rf" in the window of {source}(, not in \d+)?$"):
        shared([Reader(), Row(), Motion()])


def test_several_lanes_do_not_share() -> None:
    with pytest.raises(ScheduleError, match=r"^row shares the states of motion, for which .* fast"):
        shared_core("fast")
