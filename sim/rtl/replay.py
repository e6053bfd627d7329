"""The files of `replay.sv`: records and bus writes in, words and cycles out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = [
    "BusWrite",
    "RegisterWrite",
    "RtlRun",
    "bus_text",
    "input_text",
    "read_output",
    "register_writes",
]


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


def input_text(inputs: IntArray, n_in: IntArray, word: int) -> str:
    """Words of records (steps, widest), of which the first ``n_in`` count; their last is marked."""
    last = np.arange(inputs.shape[1]) == n_in[:, None] - 1
    marked = (inputs & ((1 << word) - 1)) | np.where(last, 1 << word, 0)
    there = np.arange(inputs.shape[1]) < n_in[:, None]
    return "\n".join(f"{w:x}" for w in marked[there].tolist()) + "\n"


def bus_text(writes: Iterable[BusWrite], word: int) -> str:
    """What the host writes meanwhile, in the order of records."""
    mask = (1 << word) - 1
    return "".join(f"{w.record} {w.address:x} {w.word & mask:x}\n" for w in writes)


def read_output(lines: Sequence[str], n_out: IntArray, word: int) -> RtlRun:
    """What happened, from the lines of the output file.

    Parameters
    ----------
    n_out : int (steps,)
        Words that each record gives.

    Raises
    ------
    SimulationFailed
        An unknown value (X), a word too many, or an update that did not complete.
    """
    steps, widest = len(n_out), int(n_out.max())
    outputs, latency = np.zeros((2, steps, widest), dtype=np.int64)
    seen = np.arange(widest) >= n_out[:, None]
    saturated = np.zeros(steps, dtype=np.bool_)
    interval = np.full(steps, -1, dtype=np.int64)
    sign = 1 << (word - 1)
    for line in lines:
        kind, *rest = line.split()
        if (
            kind == "X"
            or (kind == "O" and set("xz") & set(rest[2].lower()))
            or (kind == "U" and set("xz") & set(rest[1].lower()))
        ):
            raise SimulationFailed(f"unknown value (X): {line}")
        if kind == "O":
            k, j = int(rest[0]), int(rest[1])
            if k >= steps or j >= n_out[k]:
                raise SimulationFailed(f"unexpected output word: {line}")
            outputs[k, j] = (int(rest[2], 16) ^ sign) - sign
            latency[k, j] = int(rest[3]) + 1
            seen[k, j] = True
        elif kind == "U":
            saturated[int(rest[0])] = rest[1] == "1"
            interval[int(rest[0])] = int(rest[2])
    complete = seen.all(axis=1) & (interval >= 0)
    if not complete.all():
        raise SimulationFailed(f"update {int(np.argmin(complete))} of {steps} did not complete")
    return RtlRun(outputs, saturated, latency, interval)


def register_writes(lines: Sequence[str]) -> tuple[RegisterWrite, ...]:
    """Register writes of the traced update."""
    writes = []
    for line in lines:
        kind, *rest = line.split()
        if kind == "R":
            known = not set("xz") & set((rest[2] + rest[3]).lower())
            writes.append(
                RegisterWrite(
                    int(rest[1]),
                    int(rest[2], 16) if known else -1,
                    int(rest[3], 16) if known else None,
                    int(rest[4]),
                )
            )
    return tuple(writes)
