"""Scheduling: a program and a machine become a `Schedule`.

List scheduling (`gateware.schedule.list_pass`) with priorities from longest paths
(`gateware.schedule.problem`), in each of a few variants. The best schedule is taken: the one
with the smallest latency of the last urgent output, then the shortest, then the one with the
fewest slots. The same arguments give the same schedule on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.list_pass import list_pass
from boresight.gateware.schedule.problem import ListProblem, Variant, paths
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.model.words.program import Kind, Program

VARIANTS = tuple(
    Variant(reuse, delay_gets=delay_gets, whole_group=whole_group)
    for reuse, delay_gets, whole_group in product((4, 16, 32), (True, False), (True, False))
)


def schedule(
    program: Program,
    machine: Machine,
    *,
    urgent: int | None = None,
    state_quota: Sequence[int] | None = None,
) -> Schedule:
    """Schedule a program on a machine with its arithmetic; ScheduleError if it does not fit.

    ``urgent`` is the number of leading outputs whose latency counts first, by default all;
    ``state_quota`` the most next states of each lane, by default what its bank holds.
    """
    if urgent is None:
        urgent = len(program.outputs)
    if not 0 <= urgent <= len(program.outputs):
        raise ValueError(f"urgent must be 0 to {len(program.outputs)}, not {urgent!r}")
    if program.arithmetic != machine.arithmetic:
        raise ScheduleError(
            f"{program.name}: program and machine must have the same arithmetic, "
            f"not {program.arithmetic} and {machine.arithmetic}"
        )
    lowered = with_copies(program)
    far = paths(lowered, machine, urgent)
    problem = ListProblem(lowered, machine, far=far, urgent=urgent, state_quota=state_quota)
    _check_size(problem)
    best = min((list_pass(problem, variant) for variant in VARIANTS), key=lambda x: x.score)
    return Schedule(
        program=lowered,
        source=program.digest,
        machine=machine,
        slots=problem.slots(best),
        gets=best.gets,
        length=best.length,
        urgent=urgent,
    )


def _check_size(problem: ListProblem) -> None:
    """Raise ScheduleError if states, operations or constants are too many for the machine."""
    program, machine = problem.program, problem.machine
    states, quota = len(program.states), sum(problem.state_quota)
    if quota < states:
        raise ScheduleError(
            f"{program.name}: {states} states, the {machine.name} machine has room for {quota}"
            f"{machine.remedy(states, quota)}"
        )
    words = -(-sum(problem.far.slots) // machine.lanes)
    if words > machine.rom_words:
        raise ScheduleError(
            f"{program.name}: program takes {words} microwords or more, the "
            f"{machine.name} machine has {machine.rom_words}; compute less in an update"
        )
    used = {v for op in program.ops for v in op.operands()}
    constants = {program.values[n].initial for n in program.of_kind(Kind.CONST) if n in used}
    params, room = len(program.of_kind(Kind.PARAM)), machine.lanes * machine.bank_depth // 2
    if len(constants) + params > room:
        raise ScheduleError(
            f"{program.name}: {len(constants)} constants and {params} parameters, the "
            f"{machine.name} machine has {room} registers for them"
            f"{machine.remedy(len(constants) + params, room)}"
        )
