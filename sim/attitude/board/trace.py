"""Output of `bench.sv` as arrays."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from boresight.model.arrays import IntArray
from boresight.sim.rtl.simulators import SimulationFailed

Cycles: TypeAlias = IntArray


@dataclass(frozen=True)
class Line:
    """A good line of the compass: cycle, whether counts, its three numbers, the device's slot."""

    cycle: int
    counts: bool
    values: tuple[int, int, int]
    slot: int


@dataclass(frozen=True)
class Trace:
    """Events of a run, each with its clock cycle.

    Attributes
    ----------
    ready : int64 (n, 2)
        Cycle in which data-ready rose, and the device's line of the log then, from 1 on.
    samples, updates : int64
        Cycles in which a sample was in the reader's buffer, and an update in the registers.
    faults : list of (cycle, inertial bits, compass bits)
        Faults of the devices from that cycle on.
    events : list of (cycle, bits)
        Pulses of the counted events (`AttitudeSystem.events`).
    lines : tuple of Line
        Good lines of the compass.
    bytes_at : int64, data : bytes
        Cycle in which the stop bit of each byte to the host began; the bytes.
    framing_errors : int64
        Bytes to the host without stop bit.
    violations : int
        Number of violations of the device's timing by the reader.
    """

    ready: Cycles
    samples: Cycles
    updates: Cycles
    faults: list[tuple[int, int, int]]
    events: list[tuple[int, int]] = field(repr=False)
    lines: tuple[Line, ...]
    bytes_at: Cycles
    data: bytes = field(repr=False)
    framing_errors: Cycles
    violations: int


def read_trace(text: str) -> Trace:
    """Read the text of a trace.

    Raises
    ------
    SimulationFailed
        Unknown values (X) at the pins, or a trace without an end.
    """
    rows: dict[str, list[list[str]]] = defaultdict(list)
    for line in text.splitlines():
        cycle, kind, *rest = line.split()
        if kind == "X":
            raise SimulationFailed(f"unknown value (X) at the board's pins in cycle {cycle}")
        rows[kind].append([cycle, *rest])
    if not rows["V"]:
        raise SimulationFailed("the board's bench did not come to its end")

    def numbers(kind: str, columns: int) -> Cycles:
        return np.array(rows[kind], dtype=np.int64).reshape(-1, columns)

    return Trace(
        ready=numbers("R", 2),
        samples=numbers("S", 1)[:, 0],
        updates=np.array([int(row[0]) for row in rows["U"]], dtype=np.int64),
        framing_errors=numbers("E", 1)[:, 0],
        faults=[(int(t), int(adis, 16), int(hmr, 16)) for t, adis, hmr in rows["F"]],
        events=[(int(t), int(bits, 16)) for t, bits in rows["N"]],
        lines=tuple(
            Line(int(t), counts == "1", (int(a), int(b), int(c)), int(slot))
            for t, counts, a, b, c, slot in rows["L"]
        ),
        bytes_at=np.array([int(t) for t, _ in rows["B"]], dtype=np.int64),
        data=bytes(int(byte, 16) for _, byte in rows["B"]),
        violations=int(rows["V"][-1][1]),
    )
