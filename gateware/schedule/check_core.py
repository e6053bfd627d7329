"""Checker: proves that the programs of a core leave each other's words alone.

`gateware.schedule.check` proves each program by itself: a slot that reads a register finds there
what its op asks for, so a program reads no word of another but those that its links name. Here it
is shown that what one of them relies on between its updates (constants, parameters, its states) is
written by no other, and that a link leads where it says: to the state of the program it names whose
next value is the output it names, in the same format, in the window block of that program, and to
the current copy of it. The copies change places at the end of a complete update alone (`home` is
the last word of a program, `gateware.microcode.image`), and one program runs at a time, so a reader
sees the words of one complete update.
"""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.check import check_schedule
from boresight.gateware.schedule.links import Window
from boresight.gateware.schedule.slots import Schedule, ScheduleError
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
        What was made of them.
    """
    before = 0
    for program, schedule, allocation in zip(programs, schedules, allocations, strict=True):
        check_schedule(program, schedule, allocation, parameters_before=before)
        before += len(program.of_kind(Kind.PARAM))
    for k, (mine, own) in enumerate(zip(schedules, allocations, strict=True)):
        kept = _kept(mine, own)
        for j, (other, foreign) in enumerate(zip(schedules, allocations, strict=True)):
            if other.machine != mine.machine or foreign.initial != own.initial:
                raise ScheduleError(
                    f"{mine.program.name} and {other.program.name} must share the "
                    "machine and its first words"
                )
            common = kept & _written(other, foreign) if j != k else set()
            if common:
                raise ScheduleError(
                    f"{other.program.name} writes register {min(common)}, which "
                    f"{mine.program.name} keeps a word in"
                )

    _check_links(programs, allocations, schedules[0].machine, window)


def _check_links(
    programs: Sequence[Program],
    allocations: Sequence[Allocation],
    machine: Machine,
    window: Window | None,
) -> None:
    """What one program reads of another, and whose parity the hardware takes for it."""
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
            other = numbers.get(link.program, k)
            if other == k:
                raise ScheduleError(f"{name} must be of another program, not of {link.program}")
            source = programs[other]
            kept = dict(source.states).get(-1 if link.state is None else link.state)
            outputs = dict(zip(source.output_names, source.outputs, strict=True))
            if kept is None or outputs.get(link.output) != kept:
                raise ScheduleError(f"{name} must be what keeps {link.program}.{link.output}")
            assert link.state is not None
            if program.format(number) != source.format(link.state):
                raise ScheduleError(f"{name} must be {source.format(link.state)}, as its source")
            register, owner = (
                where[k].get(number),
                _owner(where[other][link.state], machine, window),
            )
            if register != where[other][link.state] or owner != other:
                raise ScheduleError(
                    f"{name} must be read in register {where[other][link.state]}, in the window "
                    f"of {link.program}, not in {register}"
                )


def _owner(address: int, machine: Machine, window: Window | None) -> int | None:
    """The program whose parity reads of a state go by; None for the one that runs."""
    if window is None:
        return None
    slot = address % machine.bank_depth - machine.bank_depth // 2
    return window.owner(slot % (machine.bank_depth // 4), machine.bank_depth // 4)


def _pair(schedule: Schedule, address: int) -> set[int]:
    """A register, or for a state both of its copies: the parity says which one an address means."""
    depth = schedule.machine.bank_depth
    if address % depth < depth // 2:
        return {address}
    low = address & ~(depth // 4)
    return {low, low + depth // 4}


def _kept(schedule: Schedule, allocation: Allocation) -> set[int]:
    """Registers whose words must survive while other programs run."""
    values = schedule.program.values
    lasting = (Kind.CONST, Kind.PARAM, Kind.STATE)
    return {
        r
        for n, address in allocation.addresses().items()
        if values[n].kind in lasting
        for r in _pair(schedule, address)
    }


def _written(schedule: Schedule, allocation: Allocation) -> set[int]:
    """Registers that the program writes, whatever its parity."""
    values = schedule.program.values
    written = (Kind.INPUT, Kind.OP)
    return {
        r
        for n, address in allocation.addresses().items()
        if values[n].kind in written and n not in schedule.program.linked
        for r in _pair(schedule, address)
    }
