"""Scheduling: a program and a machine become a `Schedule`.

List scheduling (`gateware.schedule.list_pass`) under priorities from longest paths
(`gateware.schedule.priorities`), then a local search that disturbs the priorities and keeps results
that are not worse. Compared are the latency of the last urgent output, then the length of the
program, then the cycles of all emits. The same arguments give the same schedule, on every machine.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace

from boresight.gateware.machine import Machine
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.deviates import Deviates
from boresight.gateware.schedule.list_pass import list_pass
from boresight.gateware.schedule.priorities import Paths, paths
from boresight.gateware.schedule.problem import Attempt, ListProblem, Style
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.model.words.program import Kind, Program

#: Priority of urgent nodes above the others, in cycles.
_LEAD = 1000.0
#: First style tried, and the variations of the search.
_FIRST = Style(reuse=16.0, keep=0.0)
_REUSE = (2.0, 4.0, 8.0, 16.0, 32.0)
_KEEP = (0.0, 4.0, 8.0)
_PATIENCE = (None, 0.0, 4.0)
_DETOUR = (1, 2, 3)
_STAY = (0, 1, 2, 4)
#: Minimum and maximum passes by default, and nodes placed in all of them.
_PASSES = (20, 300)
_EFFORT = 80_000
#: Share of the passes that try styles; the others use the best one.
_STYLE_SHARE = 0.2


def schedule(
    program: Program,
    machine: Machine,
    *,
    urgent: int | None = None,
    restarts: int | None = None,
    seed: int = 0,
    state_quota: Sequence[int] | None = None,
) -> Schedule:
    """Schedule a program on a machine.

    Parameters
    ----------
    program : Program
        Source program; states get their copies here (`gateware.schedule.copies`).
    machine : Machine
        Machine with the program's arithmetic.
    urgent : int, 0..number of outputs, optional
        Leading outputs whose latency counts first. Default: all.
    restarts : int, >= 0, optional
        Passes after the first one; more passes give slightly better schedules. Default: fewer for
        longer programs, so that every search takes a few seconds.
    seed : int
        Seed of the local search.
    state_quota : sequence of int, optional
        Maximum number of next states for each lane. Default: the capacity of its bank.

    Raises
    ------
    ScheduleError
        The program does not fit.
    """
    if urgent is None:
        urgent = len(program.outputs)
    if not 0 <= urgent <= len(program.outputs):
        raise ValueError(f"urgent must be 0 to {len(program.outputs)}, not {urgent!r}")
    if restarts is not None and restarts < 0:
        raise ValueError(f"restarts must be 0 or more, not {restarts!r}")
    if program.arithmetic != machine.arithmetic:
        raise ScheduleError(
            f"{program.name}: program and machine must have the same arithmetic, "
            f"not {program.arithmetic} and {machine.arithmetic}"
        )
    lowered = with_copies(program)
    far = paths(lowered, machine, urgent)
    problem = ListProblem(lowered, machine, far=far, urgent=urgent, state_quota=state_quota)
    states, quota = len(lowered.states), sum(problem.state_quota)
    if quota < states:
        raise ScheduleError(
            f"{program.name}: {states} states, the {machine.name} machine has room for {quota}"
            f"{machine.remedy(states, quota)}"
        )
    _check_size(lowered, machine, far)
    if restarts is None:
        restarts = max(_PASSES[0], min(_PASSES[1], _EFFORT // problem.nodes))
    best = _search(problem, restarts, random.Random(seed))
    if best.length > machine.rom_words:
        raise ScheduleError(
            f"{program.name}: program takes {best.length} microwords, the "
            f"{machine.name} machine has {machine.rom_words}; compute less in a sample"
        )
    return Schedule(
        program=lowered,
        source=program.digest,
        machine=machine,
        slots=problem.slots(best),
        gets=best.gets,
        length=best.length,
        urgent=urgent,
    )


def _check_size(program: Program, machine: Machine, far: Paths) -> None:
    """Raise ScheduleError, before the search, if no schedule can fit."""
    if far.length_bound > machine.rom_words:
        raise ScheduleError(
            f"{program.name}: program takes {far.length_bound} microwords or more, the "
            f"{machine.name} machine has {machine.rom_words}; compute less in a sample"
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


def _priorities(far: Paths) -> list[float]:
    """Base priority of every node: cycles after its start, plus `_LEAD` for urgent nodes."""
    return [
        (total if urgent is None else urgent + _LEAD) + slots - 1.0
        for urgent, total, slots in zip(far.urgent, far.total, far.slots, strict=True)
    ]


def _style(rng: random.Random) -> Style:
    """A random style."""
    return Style(
        reuse=rng.choice(_REUSE),
        keep=rng.choice(_KEEP),
        patience=rng.choice(_PATIENCE),
        hold=rng.random() < 0.9,
        detour=rng.choice(_DETOUR),
        stay=rng.choice(_STAY),
    )


def _disturb(
    priority: Sequence[float],
    problem: ListProblem,
    urgent_ops: Sequence[int],
    rng: random.Random,
    deviates: Deviates,
) -> list[float]:
    """Priorities with a few nodes changed, or a node with all its predecessors or successors."""
    trial = list(priority)
    candidates = urgent_ops if urgent_ops and rng.random() < 0.8 else range(len(trial))
    size = rng.choice((2.0, 5.0, 12.0, 40.0))
    if rng.random() < 0.5:
        for _ in range(rng.choice((1, 2, 4, 8, 16))):
            trial[rng.choice(candidates)] += deviates.draw(size)
        return trial
    for _ in range(rng.choice((1, 1, 2, 3))):
        change = deviates.draw(size)
        edges = problem.producers if rng.random() < 0.7 else problem.consumers
        for k in _closure(edges, rng.choice(candidates)):
            trial[k] += change
    return trial


def _closure(edges: Sequence[Sequence[int]], node: int) -> list[int]:
    """``node`` and all nodes that ``edges`` reach from it."""
    out, visited = [node], {node}
    for k in out:
        for neighbour in edges[k]:
            if neighbour not in visited:
                visited.add(neighbour)
                out.append(neighbour)
    return out


def _search(problem: ListProblem, restarts: int, rng: random.Random) -> Attempt:
    """Best attempt: first under many styles, then with priorities disturbed."""
    far = problem.far
    deviates = Deviates(rng)
    # If outputs are a large part of all nodes, each is best read by an op while it is emitted.
    carry = 2 * len(problem.program.outputs) >= problem.n_ops
    priority, style = _priorities(far), replace(_FIRST, carry=carry)
    best = list_pass(problem, priority, style)
    assert best is not None
    urgent_ops = [k for k, tail in enumerate(far.urgent) if tail is not None]
    for k in range(restarts):
        latency, length = best.score[:2]
        if latency <= far.latency_bound and length <= far.length_bound:
            break
        trial, trial_style = priority, style
        if k < restarts * _STYLE_SHARE:
            trial_style = replace(_style(rng), carry=carry)
        else:
            trial = _disturb(priority, problem, urgent_ops, rng, deviates)
            if rng.random() < 0.1:
                trial_style = replace(_style(rng), carry=carry)
        attempt = list_pass(problem, trial, trial_style, (latency, length))
        if attempt is not None and attempt.score <= best.score:
            best, priority, style = attempt, trial, trial_style
    return best
