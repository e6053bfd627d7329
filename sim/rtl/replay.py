"""Records replayed through a core's Verilog: the batch for a bench, and its result."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
    comes then.
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
    """Result of a replay."""

    #: (steps, n_outputs): words in stream order, padded with 0.
    outputs: IntArray
    #: (steps,): a result was clamped; an input word was beyond its declared range.
    saturated: BoolArray
    beyond: BoolArray
    #: (steps, n_outputs): cycles from the first input word taken to each output word taken, both
    #: inclusive; 0 for a word that was not given.
    latency_cycles: IntArray
    #: (steps,): cycles from the first input word taken until the next record could begin; -2: a
    #: `Reset` came before.
    interval_cycles: IntArray
    #: Register writes of the traced update.
    writes: tuple[RegisterWrite, ...] = ()


@dataclass(frozen=True, eq=False)
class Batch:
    """Records for a bench."""

    #: (steps, widest): words of each record, padded; the first ``n_in`` count.
    inputs: IntArray
    #: (steps,): numbers of input and output words of each record.
    n_in: IntArray
    n_out: IntArray
    #: In the order of records, the reset of one behind its writes.
    bus_writes: Sequence[BusWrite | Reset]
    #: 0: no pauses of input and output. Otherwise the seed of a pattern of pauses.
    stall: int
    #: Record whose register writes are recorded; -1 for none.
    trace: int
    #: Cycles after which the core counts as hung.
    limit: int

    def text(self) -> str:
        """The batch as numbers in the order of `bench.sv`."""
        head = (len(self.inputs), len(self.bus_writes), self.stall, self.trace, self.limit)
        valid = np.arange(self.inputs.shape[1]) < self.n_in[:, None]
        writes = [
            (w.record, -1 - w.restart, w.cycle)
            if isinstance(w, Reset)
            else (w.record, w.address, w.word)
            for w in self.bus_writes
        ]
        numbers = np.concatenate([head, self.n_in, self.inputs[valid], np.ravel(writes)])
        return " ".join(map(str, numbers.astype(np.int64).tolist())) + "\n"

    def result(self, lines: Sequence[bytes], unknown: str, word: int, tool: str) -> RtlRun:
        """Read the result of a bench: ``lines`` as `bench.sv` defines them.

        ``unknown`` is the unknown value that ended the batch, or empty; ``word`` the width in bits.
        Raises ReplayFailed for it, an unexpected number of words, or an update that did not end.
        """
        rows = np.array(b"".join(lines).split(), dtype=np.int64).reshape(-1, 4)
        kinds, mask = rows[:, 0], (1 << word) - 1
        writes = tuple(
            RegisterWrite(kind - 2, address, value & mask if address >= 0 else None, cycle)
            for kind, address, value, cycle in rows[kinds > 1].tolist()
        )
        words, cycles = rows[kinds == 1, 1:3].T
        words = (words ^ (mask + 1 >> 1)) - (mask + 1 >> 1)  # the sign of the word
        ends = kinds == 0
        flags, intervals = rows[ends, 1:3].T
        counts = np.diff(np.cumsum(kinds == 1)[ends], prepend=0)
        was_reset = intervals == -2
        n_out = np.where(was_reset, counts, self.n_out[: len(counts)])
        mismatches = (counts != n_out) | ((intervals < 0) & ~was_reset)
        fault = f"unknown value (X): {unknown}" if unknown else ""
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


_BLOCK = re.compile(
    r"  initial begin\n((?:    (?P<name>[^\s\[]+)\[\d+\] = \d+'[dhb][0-9a-fx]+;\n)+)  end\n"
)
_WORD = re.compile(r"\[(\d+)\] = \d+'([dhb])([0-9a-f]+);")
_BASE = {"d": 10, "h": 16, "b": 2}


def split_memories(verilog: str) -> tuple[str, dict[str, str]]:
    """Verilog that reads its memories from files, and the files by name."""
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
