"""Output of `bench.sv` as arrays."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import IntArray
from boresight.sim.rtl.simulators import SimulationFailed


class Line(NamedTuple):
    """A good line of the compass: cycle, whether counts, its three numbers, the device's slot."""

    cycle: int
    counts: bool
    values: tuple[int, int, int]
    slot: int


@dataclass(frozen=True)
class Trace:
    """Events of a run, each with its clock cycle (int64)."""

    #: Cycle in which data-ready rose, and the device's line of the log then, from 1 on: (n, 2).
    ready: IntArray
    #: Cycles in which a sample was in the reader's buffer, and an update in the registers.
    samples: IntArray
    updates: IntArray
    #: Cycle, inertial bits, compass bits: faults of the devices from that cycle on.
    faults: list[tuple[int, int, int]]
    #: Cycle, bits: pulses of the counted events (`AttitudeSystem.events`).
    events: list[tuple[int, int]] = field(repr=False)
    lines: tuple[Line, ...]
    #: Cycle in which the stop bit of each byte to the host began; the bytes.
    bytes_at: IntArray
    data: bytes = field(repr=False)
    #: Bytes to the host without stop bit.
    framing_errors: IntArray
    #: Violations of the device's timing by the reader.
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

    def numbers(kind: str, columns: int) -> IntArray:
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
