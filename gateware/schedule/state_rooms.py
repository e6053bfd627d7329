"""How many states of each program may live in each bank, so that all programs fit.

A state lives in the bank of the lane that computes its next value, which the scheduler chooses.
With several programs it has to choose such that no bank overflows.
"""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.program import Program


def state_rooms(programs: Sequence[Program], machine: Machine) -> list[tuple[int, ...]]:
    """For each program, the most states that it may have in each bank.

    Everybody gets an even share of the lanes for the states there are, and of what is left over a
    part in proportion to their number.

    Raises
    ------
    ScheduleError
        More states in all than the machine has room for.
    """
    lanes, slots = machine.lanes, machine.state_slots
    counts = [len(p.states) for p in programs]
    total = sum(counts)
    if total > lanes * slots:
        said = [f"{p.name} {n}" for p, n in zip(programs, counts, strict=True)]
        raise ScheduleError(
            f"{', '.join(said) if len(said) > 1 else programs[0].name}: {total} states, the "
            f"{machine.name} machine has room for {lanes * slots}{machine.remedy}"
        )
    spare = slots - -(-total // lanes)
    rooms, first = [], 0
    for count in counts:
        # The k-th state of all belongs to lane k modulo lanes.
        even = [len(range((lane - first) % lanes, count, lanes)) for lane in range(lanes)]
        rooms.append(tuple(n + (spare * count // total if total else 0) for n in even))
        first += count
    return rooms
