"""Several programs on one simulated core, taking turns.

Each program has a stream of records of its own. The streams are cut into pieces that are dealt in
random order; before each piece the host writes the program's number. A program must give the words
that it gives alone: so its states outlive the turns of the others.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.cosim import BusWrite, RtlRun, RtlSimulation

__all__ = ["Turn", "deal", "run_in_turns", "selection"]


@dataclass(frozen=True)
class Turn:
    """Records ``start`` to ``stop`` - 1 of a program's stream."""

    number: int
    start: int
    stop: int


def selection(core: Core) -> tuple[BusWrite, ...]:
    """What the host writes to run the program at hand."""
    return (BusWrite(0, PROGRAM, core.number),) if len(core.parts) > 1 else ()


def deal(counts: Sequence[int], *, seed: int = 0, longest: int = 40) -> list[Turn]:
    """Random turns until every stream of ``counts`` records has ended."""
    rng = random.Random(seed)
    at = [0] * len(counts)
    turns = []
    while left := [k for k, n in enumerate(counts) if at[k] < n]:
        k = rng.choice(left)
        stop = min(counts[k], at[k] + rng.randint(1, longest))
        turns.append(Turn(k, at[k], stop))
        at[k] = stop
    return turns


def run_in_turns(
    core: Core,
    simulation: RtlSimulation,
    streams: Sequence[IntArray],
    *,
    seed: int = 0,
    stall: int = 0,
    longest: int = 40,
) -> list[RtlRun]:
    """Run every program of a core on its own stream, in turns.

    Now and then the host also writes a number that no program has, which must change nothing.

    Parameters
    ----------
    core : Core
        Its programs must have equally long records.
    simulation : RtlSimulation
        Of that core.
    streams : sequence of int (steps, n_inputs)
        Input records of each program.
    seed, longest : int
        See `deal`.
    stall : int
        See `RtlSimulation.run`.

    Returns
    -------
    list of RtlRun
        For each program, as if it had run alone.
    """
    turns = deal([len(s) for s in streams], seed=seed, longest=longest)
    rng = random.Random(seed)
    owners: list[int] = []
    writes = []
    for turn in turns:
        record = len(owners)
        writes.append(BusWrite(record, PROGRAM, turn.number))
        if rng.random() < 0.25:
            writes.append(BusWrite(record, PROGRAM, rng.choice((len(core.parts), -1))))
        owners += [turn.number] * (turn.stop - turn.start)
    words = np.concatenate([streams[t.number][t.start : t.stop] for t in turns])
    run = simulation.run(
        words,
        max_interval=max(p.schedule.interval for p in core.parts) + 64,
        stall=stall,
        bus_writes=writes,
    )
    rows = [np.array(owners) == k for k in range(len(streams))]
    return [
        RtlRun(run.outputs[r], run.saturated[r], run.latency_cycles[r], run.interval_cycles[r])
        for r in rows
    ]
