"""Several programs on one simulated core, taking turns.

Each program has its own stream of records. The streams are cut into pieces that run in random
order; before each piece the host writes the program's number. A program must give the same words as
alone, so its states must survive the turns of the others.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.replay import BusWrite, RtlRun, RtlSimulation

__all__ = ["Turn", "random_turns", "run_in_turns"]


@dataclass(frozen=True)
class Turn:
    """Records ``start`` to ``stop`` - 1 of a program's stream."""

    number: int
    start: int
    stop: int


def random_turns(counts: Sequence[int], *, seed: int = 0, longest: int = 40) -> list[Turn]:
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
    simulation: RtlSimulation,
    streams: Sequence[IntArray],
    *,
    seed: int = 0,
    stall: int = 0,
    longest: int = 40,
    replay: Callable[..., RtlRun] | None = None,
) -> list[RtlRun]:
    """Run every program of a core on its own stream, in turns.

    At random times the host also writes a number without a program, which must have no effect.

    Parameters
    ----------
    simulation : RtlSimulation
        Simulation of the core.
    streams : sequence of int (steps, n_inputs)
        Input records of each program.
    seed, longest : int
        See `random_turns`.
    stall : int
        See `RtlSimulation.run`.
    replay : callable, optional
        Runs the records, by default `RtlSimulation.run`: from a reset on.

    Returns
    -------
    list of RtlRun
        For each program, as if it had run alone.
    """
    rng, parts = random.Random(seed), simulation.core.parts
    widest = max(s.shape[1] for s in streams)
    rows, writes = [], []
    numbers: list[int] = []
    for turn in random_turns([len(s) for s in streams], seed=seed, longest=longest):
        writes.append(BusWrite(len(numbers), PROGRAM, turn.number))
        if rng.random() < 0.25:
            writes.append(BusWrite(len(numbers), PROGRAM, rng.choice((len(parts), -1))))
        piece = streams[turn.number][turn.start : turn.stop]
        rows.append(np.pad(piece, ((0, 0), (0, widest - piece.shape[1]))))
        numbers += [turn.number] * len(piece)
    run = (replay or simulation.run)(
        np.concatenate(rows), numbers=np.array(numbers), stall=stall, bus_writes=writes
    )
    out = []
    for k, part in enumerate(parts):
        mine, n_out = np.array(numbers) == k, len(part.program.outputs)
        words, latency = run.outputs[mine, :n_out], run.latency_cycles[mine, :n_out]
        out.append(RtlRun(words, run.saturated[mine], latency, run.interval_cycles[mine]))
    return out
