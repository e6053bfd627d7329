"""State quotas: numbers of states of each program in each bank, so that all programs fit.

A state is in the bank of the lane that computes its next value, which the scheduler chooses. With
several programs the quotas prevent that a bank overflows.
"""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.program import Program


def state_quotas(programs: Sequence[Program], machine: Machine) -> list[tuple[int, ...]]:
    """For each program, the maximum number of states in each bank.

    Each program gets an even share of the lanes for its states, and a part of the remaining
    registers in proportion to its number of states.

    Raises
    ------
    ScheduleError
        The programs have more states than the machine.
    """
    lanes, slots = machine.lanes, machine.state_slots
    counts = [len(p.states) for p in programs]
    total = sum(counts)
    if total > lanes * slots:
        counted = [f"{p.name} {n}" for p, n in zip(programs, counts, strict=True)]
        raise ScheduleError(
            f"{', '.join(counted) if len(counted) > 1 else programs[0].name}: {total} states, the "
            f"{machine.name} machine has room for {lanes * slots}"
            f"{machine.remedy(total, lanes * slots)}"
        )
    spare = slots - -(-total // lanes)
    quotas, first = [], 0
    for count in counts:
        # The k-th state of all is in lane k modulo lanes.
        shares = [len(range((lane - first) % lanes, count, lanes)) for lane in range(lanes)]
        quotas.append(tuple(n + (spare * count // total if total else 0) for n in shares))
        first += count
    return quotas
