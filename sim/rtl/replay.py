"""Records replayed through a core's Verilog: what is asked of a bench, and what it gives back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.memories import split_memories
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["Batch", "BusWrite", "RegisterWrite", "ReplayFailed", "RtlRun", "RtlSimulation"]


@dataclass(frozen=True)
class BusWrite:
    """A word for the bus, written before the first word of ``record`` is offered."""

    record: int
    address: int
    word: int


@dataclass(frozen=True)
class RegisterWrite:
    """A lane's write of a register: ``word`` None if it had unknown bits."""

    lane: int
    address: int
    word: int | None
    cycle: int


@dataclass(frozen=True)
class RtlRun:
    """What the core did.

    Attributes
    ----------
    outputs : int64 (steps, n_outputs)
        Output words in stream order; 0 behind the end of a shorter record.
    saturated : bool (steps,)
        The update's saturation flag.
    latency_cycles : int64 (steps, n_outputs)
        Cycles from the first input word taken to each output word taken, both inclusive.
    interval_cycles : int64 (steps,)
        Cycles from the first input word taken until the next record could begin.
    writes : tuple of RegisterWrite
        Register writes of the traced update.
    """

    outputs: IntArray
    saturated: npt.NDArray[np.bool_]
    latency_cycles: IntArray
    interval_cycles: IntArray
    writes: tuple[RegisterWrite, ...] = ()


@dataclass(frozen=True, eq=False)
class Batch:
    """Records for a bench.

    Attributes
    ----------
    inputs : int64 (steps, widest)
        Words of each record, of which the first ``n_in`` count.
    n_in, n_out : int64 (steps,)
        Words that each record has and gives.
    bus_writes : sequence of BusWrite
        In the order of records.
    stall : int
        0: input always there, output always taken. Otherwise the seed of a pattern of pauses.
    trace : int
        Record whose register writes are wanted; -1 for none.
    limit : int
        Cycles after which the core counts as hung.
    """

    inputs: IntArray
    n_in: IntArray
    n_out: IntArray
    bus_writes: Sequence[BusWrite]
    stall: int
    trace: int
    limit: int


class ReplayFailed(SimulationFailed):
    """A replay that is no result: hung, an unknown value, or other words than expected.

    Attributes
    ----------
    writes : tuple of RegisterWrite
        Register writes of the traced update.
    """

    def __init__(self, message: str, writes: tuple[RegisterWrite, ...] = ()) -> None:
        super().__init__(message)
        self.writes = writes


class RtlSimulation(ABC):
    """A built simulation of one core, run as often as wanted.

    The build depends on the machine, not on the program (`sim.rtl.memories`), and is kept in a
    cache.

    Parameters
    ----------
    core : Core
        Its selected program runs, unless `run` is given others.
    """

    def __init__(self, core: Core) -> None:
        self.core, self.word = core, core.machine.arithmetic.word
        self.text, self.memories = split_memories(core.verilog(instances=False))
        if core.machine.lanes == 2:
            # The benches name signals of the second lane only where there is one.
            self.text = f"`define TWO_LANES\n{self.text}"

    def run(
        self,
        inputs: IntArray,
        *,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite] = (),
        stall: int = 0,
        trace: int | None = None,
        allow_unknown: bool = False,
    ) -> RtlRun:
        """Run input words (steps, n_inputs) from the core's reset on.

        Parameters
        ----------
        numbers : int (steps,), optional
            The program of each record, when several take turns (`bus_writes` must select them);
            what a record does not need of its row is left out. By default the selected one.
        bus_writes, stall
            See `Batch`.
        trace : int, optional
            Update whose register writes are recorded.
        allow_unknown : bool
            Return the register writes even when the run fails (to find out why).

        Raises
        ------
        SimulationFailed
            Hung, an unknown value (X), or fewer words than expected.
        """
        batch = self.batch(inputs, numbers, bus_writes, stall=stall, trace=trace)
        try:
            return self._replay(batch)
        except ReplayFailed as failed:
            if not allow_unknown:
                raise
            none = np.zeros((0, 0), dtype=np.int64)
            return RtlRun(none, np.zeros(0, dtype=np.bool_), none, none.ravel(), failed.writes)

    def batch(
        self,
        inputs: IntArray,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite] = (),
        *,
        stall: int = 0,
        trace: int | None = None,
    ) -> Batch:
        """Everything that a bench needs for these records; see `run`."""
        if not len(inputs):
            raise SimulationFailed("nothing to compare: no input records")
        parts = self.core.parts
        if numbers is None:
            numbers = np.full(len(inputs), self.core.number)
            if len(parts) > 1:
                bus_writes = [BusWrite(0, PROGRAM, self.core.number), *bus_writes]
        counts = [
            (len(p.program.streamed), len(p.program.outputs), p.schedule.interval) for p in parts
        ]
        n_in, n_out, intervals = np.array(counts)[numbers].T
        cycles = (len(inputs) + 4) * int(intervals.max()) * (16 if stall else 1)
        limit = cycles + 64 * len(bus_writes) + 1000
        return Batch(inputs, n_in, n_out, bus_writes, stall, -1 if trace is None else trace, limit)

    @abstractmethod
    def _replay(self, batch: Batch) -> RtlRun:
        """Run a batch from the core's reset on; `ReplayFailed` if that gives no result."""
