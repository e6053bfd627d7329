"""Checker: proves that the programs of a core do not disturb each other's words.

`gateware.schedule.check` proves each program by itself: every slot reads the values of its op, so a
program reads words of another one only through its links. This module proves that the words that a
program needs between its updates (constants, parameters, its states) are not written by others, and
that a link reads its source: the state of the named program whose next value is the named output,
in the same format, in the window block of that program, and its current copy. The copies are
exchanged only at the end of a complete update (`home` is the last word of a program,
`gateware.microcode.image`), and one program runs at a time, so a reader sees the words of one
complete update.

Programs that share states have one parity. Each has all of these states, in the same registers and
formats, and writes all their next copies in every update (`gateware.schedule.check`: a state's next
value is the result of an operation), so whichever was last, the current copies are those of one
complete update.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.check import check_schedule
from boresight.gateware.schedule.links import Window
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.model.linking import families
from boresight.model.words.program import Kind, Program


def check_core(
    programs: Sequence[Program],
    schedules: Sequence[Schedule],
    allocations: Sequence[Allocation],
    window: Window | None = None,
) -> None:
    """Pass, or raise `ScheduleError` with the program and the register of the first fault.

    Parameters
    ----------
    programs : sequence of Program
        The source programs, in the order of their numbers.
    schedules, allocations, window
        Their schedules, registers and window.
    """
    before = 0
    for program, schedule, allocation in zip(programs, schedules, allocations, strict=True):
        check_schedule(program, schedule, allocation, parameters_before=before)
        before += len(program.of_kind(Kind.PARAM))
    family = families(programs)
    for k, (owner, registers) in enumerate(zip(schedules, allocations, strict=True)):
        preserved = _preserved(owner, registers)
        for j, (writer, foreign) in enumerate(zip(schedules, allocations, strict=True)):
            if writer.machine != owner.machine or foreign.initial != registers.initial:
                raise ScheduleError(
                    f"{owner.program.name} and {writer.program.name} must share the "
                    "machine and its first words"
                )
            common = preserved & _written(writer, foreign) if j != k else set()
            if family[j] == family[k]:
                common -= _of_states(owner, registers)
            if common:
                raise ScheduleError(
                    f"{writer.program.name} writes register {min(common)}, which "
                    f"{owner.program.name} keeps a word in"
                )

    _check_links(programs, allocations, schedules[0].machine, window)
    _check_families(programs, schedules, allocations)


def _check_families(
    programs: Sequence[Program], schedules: Sequence[Schedule], allocations: Sequence[Allocation]
) -> None:
    """Check that programs with one parity have the same states in the same registers."""
    family = families(programs)
    for k, owner in enumerate(family):
        if family[owner] != owner:
            raise ScheduleError(f"{programs[owner].name}, whose states others have, must own them")
        states, owner_states = (
            [
                (program.values[s].name, program.format(s), program.values[s].initial, where[s])
                for s, _ in program.states
            ]
            for program, where in (
                (schedules[n].program, allocations[n].addresses()) for n in (k, owner)
            )
        )
        if states != owner_states:
            mismatch = next((a or b for a, b in zip_longest(states, owner_states) if a != b), None)
            raise ScheduleError(
                f"{programs[k].name} must have the states of {programs[owner].name}, in their "
                f"registers and formats: {mismatch and mismatch[0]} differs"
            )


def _check_links(
    programs: Sequence[Program],
    allocations: Sequence[Allocation],
    machine: Machine,
    window: Window | None,
) -> None:
    """Check the links between programs, and the parities by which the hardware reads them."""
    where = [a.addresses() for a in allocations]
    numbers = {p.name: k for k, p in enumerate(programs)}
    for k, program in enumerate(programs):
        for state, _ in program.states:
            owner = _owner(where[k][state], machine, window)
            if owner not in (None, k):
                raise ScheduleError(
                    f"state {program.values[state].name} of {program.name} stands in the window "
                    f"of {programs[owner].name}"
                )
    for k, program in enumerate(programs):
        for number, link in program.linked.items():
            name = f"{program.name}: {program.values[number].name}"
            origin = numbers.get(link.program, k)
            if origin == k:
                raise ScheduleError(f"{name} must be of another program, not of {link.program}")
            source = programs[origin]
            assert link.state is not None  # every linked input has one
            following = dict(source.states).get(link.state)
            outputs = dict(zip(source.output_names, source.outputs, strict=True))
            if following is None or outputs.get(link.output) != following:
                raise ScheduleError(f"{name} must be what keeps {link.program}.{link.output}")
            if program.format(number) != source.format(link.state):
                raise ScheduleError(f"{name} must be {source.format(link.state)}, as its source")
            register, owner = (
                where[k].get(number),
                _owner(where[origin][link.state], machine, window),
            )
            if register != where[origin][link.state] or owner != origin:
                raise ScheduleError(
                    f"{name} must be read in register {where[origin][link.state]}, in the window "
                    f"of {link.program}, not in {register}"
                )


def _owner(address: int, machine: Machine, window: Window | None) -> int | None:
    """Program whose parity applies to reads of a state; None for the one that runs."""
    if window is None:
        return None
    slots = machine.bank_depth // 4
    return window.owner(address % slots, slots)


def _pair(schedule: Schedule, address: int) -> set[int]:
    """A register, or both copies of a state, between which the parity selects."""
    depth = schedule.machine.bank_depth
    if address % depth < depth // 2:
        return {address}
    low = address & ~(depth // 4)
    return {low, low + depth // 4}


def _preserved(schedule: Schedule, allocation: Allocation) -> set[int]:
    """Registers whose words must survive while other programs run."""
    values = schedule.program.values
    lasting = (Kind.CONST, Kind.PARAM, Kind.STATE)
    return {
        r
        for n, address in allocation.addresses().items()
        if values[n].kind in lasting
        for r in _pair(schedule, address)
    }


def _of_states(schedule: Schedule, allocation: Allocation) -> set[int]:
    """Registers of the states, both copies."""
    where = allocation.addresses()
    return {r for state, _ in schedule.program.states for r in _pair(schedule, where[state])}


def _written(schedule: Schedule, allocation: Allocation) -> set[int]:
    """Registers that the program writes, for either parity."""
    values = schedule.program.values
    written = (Kind.INPUT, Kind.OP)
    return {
        r
        for n, address in allocation.addresses().items()
        if values[n].kind in written and n not in schedule.program.linked
        for r in _pair(schedule, address)
    }
