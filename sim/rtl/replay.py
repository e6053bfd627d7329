"""Records replayed through a core's Verilog: the batch for a bench, and its result."""

from __future__ import annotations

import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.arrays import BoolArray
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.simulators import SimulationFailed


@dataclass(frozen=True)
class BusWrite:
    """A word written on the bus before the first word of ``record`` is offered."""

    record: int
    address: int
    word: int


@dataclass(frozen=True)
class Reset:
    """A reset of one cycle, ``cycle`` cycles after the first input word of ``record`` was taken.

    With ``restart`` it is a pulse of ``restart`` instead. If the update is complete before, it
    comes then. Only the compiled bench has it.
    """

    record: int
    cycle: int
    restart: bool = False


@dataclass(frozen=True)
class RegisterWrite:
    """A lane's write of a register; ``word`` is None if it had unknown bits."""

    lane: int
    address: int
    word: int | None
    cycle: int


@dataclass(frozen=True)
class RtlRun:
    """Result of a replay.

    Attributes
    ----------
    outputs : int64 (steps, n_outputs)
        Output words in stream order, padded with 0.
    saturated, beyond : bool (steps,)
        The update's flags: a result was clamped; an input word was beyond its declared range.
    latency_cycles : int64 (steps, n_outputs)
        Cycles from the first input word taken to each output word taken, both inclusive; 0 for a
        word that was not given.
    interval_cycles : int64 (steps,)
        Cycles from the first input word taken until the next record could begin; -2: a `Reset` came
        before.
    writes : tuple of RegisterWrite
        Register writes of the traced update.
    """

    outputs: IntArray
    saturated: BoolArray
    beyond: BoolArray
    latency_cycles: IntArray
    interval_cycles: IntArray
    writes: tuple[RegisterWrite, ...] = ()


@dataclass(frozen=True, eq=False)
class Batch:
    """Records for a bench.

    Attributes
    ----------
    inputs : int64 (steps, widest)
        Words of each record, padded; the first ``n_in`` count.
    n_in, n_out : int64 (steps,)
        Numbers of input and output words of each record.
    bus_writes : sequence of BusWrite or Reset
        In the order of records, the reset of one behind its writes.
    stall : int
        0: no pauses of input and output. Otherwise the seed of a pattern of pauses.
    trace : int
        Record whose register writes are recorded; -1 for none.
    limit : int
        Cycles after which the core counts as hung.
    """

    inputs: IntArray
    n_in: IntArray
    n_out: IntArray
    bus_writes: Sequence[BusWrite | Reset]
    stall: int
    trace: int
    limit: int

    def packed(self) -> bytes:
        """Binary form of the batch, defined in `harness.cpp`."""
        head = (len(self.inputs), len(self.bus_writes), self.stall, self.trace, self.limit)
        valid = np.arange(self.inputs.shape[1]) < self.n_in[:, None]
        writes = [
            x
            for w in self.bus_writes
            for x in (
                (w.record, -1 - w.restart, w.cycle)
                if isinstance(w, Reset)
                else (w.record, w.address, w.word)
            )
        ]
        words = np.concatenate([self.n_in, self.inputs[valid], np.array(writes, dtype=np.int64)])
        return np.array(head, dtype=np.int64).tobytes() + words.astype(np.int32).tobytes()

    def result(
        self, read: Callable[[int], bytes], *, word: int, tool: str, fault: str = ""
    ) -> RtlRun:
        """Read the result of a bench.

        Parameters
        ----------
        read : callable
            The next bytes of a bench's results, so many of them; the format is in `harness.cpp`. A
            register write with unknown bits has address -1.
        word : int
            Width, bits.
        tool : str
            Its name, for messages.
        fault : str
            Reason for a missing result, if the bench reports one; else empty.

        Raises
        ------
        ReplayFailed
            ``fault``, an unexpected number of words, or an update that did not complete.
        """
        updates, words, cycles, traced = (
            np.frombuffer(read(4 * int.from_bytes(read(8), sys.byteorder)), dtype=np.int32)
            for _ in range(4)
        )
        mask = (1 << word) - 1
        writes = tuple(
            RegisterWrite(lane, address, value & mask if address >= 0 else None, cycle)
            for lane, address, value, cycle in traced.reshape(-1, 4).tolist()
        )
        counts, flags, intervals = updates.reshape(-1, 3).T.astype(np.int64)
        was_reset = intervals == -2
        n_out = np.where(was_reset, counts, self.n_out[: len(counts)])
        mismatches = (counts != n_out) | ((intervals < 0) & ~was_reset)
        if mismatches.any() and not fault:
            k = int(np.argmax(mismatches))
            fault = f"update {k} gave {counts[k]} output words, {n_out[k]} expected"
            if intervals[k] < 0:
                fault = f"update {k} of {len(self.n_out)} did not complete"
        if fault:
            raise ReplayFailed(f"{tool}: {fault}", writes)
        valid = np.arange(self.n_out.max()) < n_out[:, None]
        outputs, latency = np.zeros((2, *valid.shape), dtype=np.int64)
        outputs[valid], latency[valid] = words, cycles + 1
        return RtlRun(outputs, flags & 1 == 1, flags > 1, latency, intervals, writes)


class ReplayFailed(SimulationFailed):
    """A replay without a result: hung, an unknown value, or an unexpected number of words.

    Attributes
    ----------
    writes : tuple of RegisterWrite
        Register writes of the traced update.
    """

    def __init__(self, message: str, writes: tuple[RegisterWrite, ...] = ()) -> None:
        super().__init__(message)
        self.writes = writes


class RtlSimulation(ABC):
    """A built simulation of one core, for any number of runs.

    The build depends on the machine, not on the program (`split_memories`), and is kept in a
    cache.

    Parameters
    ----------
    core : Core
        Core, whose selected program runs unless ``numbers`` of `run` says otherwise.
    """

    def __init__(self, core: Core) -> None:
        self.core, self.word = core, core.machine.arithmetic.word
        sources, self.memories = self.design(core)
        lanes = core.machine.lanes
        #: Parameters of `harness.sv`; signals of the second lane exist only if the core has one.
        self.parameters = {"WORD": self.word, "LANES": lanes}
        top = Path(__file__).with_name("harness.sv").read_text()
        define = "`define TWO_LANES\n" if lanes == 2 else ""
        self.sources = {**sources, "harness.sv": define + top}

    def design(self, core: Core) -> tuple[dict[str, str], dict[str, str]]:
        """Return the core's Verilog, and the files with the contents of its memories, by name."""
        text, memories = split_memories(core.verilog(instances=False))
        return {**core.files, "core.v": text}, memories

    def run(
        self,
        inputs: IntArray,
        *,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite | Reset] = (),
        stall: int = 0,
        trace: int | None = None,
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
            Update whose register writes are recorded, in `ReplayFailed` too.

        Raises
        ------
        SimulationFailed
            The core hung, gave an unknown value (X) or too few words.
        """
        return self._replay(self.batch(inputs, numbers, bus_writes, stall=stall, trace=trace))

    def batch(
        self,
        inputs: IntArray,
        numbers: IntArray | None = None,
        bus_writes: Sequence[BusWrite | Reset] = (),
        *,
        stall: int = 0,
        trace: int | None = None,
    ) -> Batch:
        """Return the batch for these records; see `run`."""
        if not len(inputs):
            raise SimulationFailed("nothing to compare: no input records")
        parts = self.core.parts
        if numbers is None:
            numbers = np.full(len(inputs), self.core.number)
            if len(parts) > 1:
                bus_writes = [BusWrite(0, PROGRAM, self.core.number), *bus_writes]
        counts = [
            (len(p.program.inputs), len(p.program.outputs), p.schedule.interval) for p in parts
        ]
        n_in, n_out, intervals = np.array(counts)[numbers].T
        cycles = (len(inputs) + 4) * int(intervals.max()) * (16 if stall else 1)
        limit = cycles + 64 * len(bus_writes) + 1000
        return Batch(inputs, n_in, n_out, bus_writes, stall, -1 if trace is None else trace, limit)

    @abstractmethod
    def _replay(self, batch: Batch) -> RtlRun:
        """Run a batch from the core's reset on; raise `ReplayFailed` without a result."""


_BLOCK = re.compile(
    r"  initial begin\n((?:    (?P<name>[^\s\[]+)\[\d+\] = \d+'[dhb][0-9a-fx]+;\n)+)  end\n"
)
_WORD = re.compile(r"\[(\d+)\] = \d+'([dhb])([0-9a-f]+);")
_BASE = {"d": 10, "h": 16, "b": 2}


def split_memories(verilog: str) -> tuple[str, dict[str, str]]:
    """Verilog that reads its memories from files, and the files by name.

    Raises
    ------
    ValueError
        The text has no initialised memory, so it is not a core.
    """
    files: dict[str, str] = {}

    def replace(match: re.Match[str]) -> str:
        name = match["name"]
        file = f"{name}.hex"
        if file in files:
            raise ValueError(f"memory {name} must have one name in the core, not several")
        words = [(int(n), int(text, _BASE[base])) for n, base, text in _WORD.findall(match[1])]
        if [n for n, _ in words] != list(range(len(words))):
            raise ValueError(f"memory {name} must be initialised in order")
        files[file] = "".join(f"{word:x}\n" for _, word in words)
        return f'  initial $readmemh("{file}", {name});\n'

    text = _BLOCK.sub(replace, verilog)
    if not files:
        raise ValueError("the Verilog must have initialised memories, not none")
    return text, files
