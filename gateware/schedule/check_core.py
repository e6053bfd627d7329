"""Checker: proves that the programs of a core leave each other's words alone.

`gateware.schedule.check` proves each program by itself. Here it is shown that what one of them
relies on between its updates (constants, parameters, its states) is written by no other.
"""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.check import check_schedule
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.model.words.program import Kind, Program

__all__ = ["check_core"]


def check_core(
    programs: Sequence[Program], schedules: Sequence[Schedule], allocations: Sequence[Allocation]
) -> None:
    """Pass, or raise `ScheduleError` with the program and the register of the first fault.

    Parameters
    ----------
    programs : sequence of Program
        The source programs, in the order of their numbers.
    schedules, allocations
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
        if values[n].kind in written
        for r in _pair(schedule, address)
    }
