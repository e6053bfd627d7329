"""Scheduling: a program and a machine become a `Schedule`.

List scheduling (`gateware.list_pass`) under priorities from longest paths (`gateware.priorities`),
then a local search that disturbs the priorities and keeps what is not worse. Compared are the
latency of the last urgent output, then the length of the program, then the cycles of all emits.
The same arguments always give the same schedule.
"""

from __future__ import annotations

import random

from gateware.copies import with_copies
from gateware.list_pass import Attempt, ListPass, Style
from gateware.machine import Machine
from gateware.priorities import Paths, paths
from gateware.slots import Schedule, ScheduleError, Slot
from model.program import Program

__all__ = ["Schedule", "ScheduleError", "Slot", "schedule"]

#: How far urgent nodes stand above the others, in cycles.
_LEADS = (1000.0, 0.0, 30.0)
_STYLES = (
    Style(),
    Style(patience=0.0),
    Style(hold=False),
    Style(reuse=0.0, keep=0.0),
    Style(reuse=1.0, keep=2.0, patience=4.0),
    Style(reuse=20.0, keep=20.0),
)


def schedule(program: Program, machine: Machine, *, urgent: int | None = None,
             restarts: int = 300, seed: int = 0) -> Schedule:
    """Lay out a program on a machine.

    Parameters
    ----------
    program : Program
        Source program; states get their copies here (`gateware.copies`).
    machine : Machine
        Its arithmetic must be the program's.
    urgent : int, 0..number of outputs, optional
        Leading outputs whose latency counts first. Default: all.
    restarts : int, >= 0
        Passes of the local search beyond the first ones.
    seed : int
        Seed of the local search.

    Raises
    ------
    ScheduleError
        If the program does not fit.
    """
    if urgent is None:
        urgent = len(program.outputs)
    if not 0 <= urgent <= len(program.outputs):
        raise ValueError(f"urgent must be 0 to {len(program.outputs)}, not {urgent!r}")
    if restarts < 0:
        raise ValueError(f"restarts must be 0 or more, not {restarts!r}")
    if program.arithmetic != machine.arithmetic:
        raise ScheduleError(f"{program.name}: program and machine must have the same arithmetic, "
                            f"not {program.arithmetic} and {machine.arithmetic}")
    lowered = with_copies(program)
    far = paths(lowered, machine, urgent)
    problem = ListPass(lowered, machine, far=far, urgent=urgent)
    best = _search(problem, restarts, random.Random(seed))
    if best.length > machine.rom_words:
        raise ScheduleError(f"{program.name}: program takes {best.length} microwords, the "
                            f"{machine.name} machine has {machine.rom_words}")
    return Schedule(program=lowered, source=program.digest, machine=machine,
                    slots=problem.slots(best), gets=best.gets, length=best.length, urgent=urgent)


def _priorities(far: Paths, lead: float) -> list[float]:
    """Base priority of every node: cycles that follow its start."""
    out = []
    for urgent, total, slots in zip(far.urgent, far.total, far.slots, strict=True):
        p = float(total)
        if urgent is not None:
            p = max(p, urgent + lead) if lead else max(p, float(urgent))
        out.append(p + slots - 1)
    return out


def _search(problem: ListPass, restarts: int, rng: random.Random) -> Attempt:
    """Best attempt of all starts and of the local search from there."""
    far = problem.far
    starts: list[tuple[Attempt, list[float], Style]] = []
    for lead in _LEADS:
        for style in _STYLES:
            priority = _priorities(far, lead)
            attempt = problem.run(priority, style)
            assert attempt is not None
            starts.append((attempt, priority, style))
    best, priority, style = min(starts, key=lambda x: x[0].score)
    hot = [k for k, tail in enumerate(far.urgent) if tail is not None]
    for _ in range(restarts):
        latency, length = best.score[:2]
        if latency <= far.latency_bound and length <= far.length_bound:
            break
        trial = list(priority)
        size = rng.choice((2.0, 5.0, 12.0, 40.0))
        some = hot if hot and rng.random() < 0.8 else range(len(trial))
        for _ in range(rng.choice((1, 2, 4, 8, 16))):
            trial[rng.choice(some)] += rng.gauss(0.0, size)
        habit = rng.choice(_STYLES) if rng.random() < 0.1 else style
        found = problem.run(trial, habit, (latency, length))
        if found is not None and found.score <= best.score:
            best, priority, style = found, trial, habit
    return best
