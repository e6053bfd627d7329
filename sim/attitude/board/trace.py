"""Output of `bench.sv` as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from boresight.model.arrays import IntArray
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["Line", "Trace", "read_trace"]

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
    select : int64 (n, 2)
        Cycles in which chip select fell and rose again.
    programs : int64 (n, 2)
        Cycle of a change of program, and the new number.
    faults : list of (cycle, inertial bits, compass bits)
        Faults of the devices from that cycle on.
    events : list of (cycle, bits)
        Pulses of the counted events (`AttitudeSystem.events`).
    lines : tuple of Line
        Good lines of the compass.
    starts : int64
        The first start bit of each burst of bytes to the host.
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
    select: Cycles
    programs: Cycles
    faults: list[tuple[int, int, int]]
    events: list[tuple[int, int]] = field(repr=False)
    lines: tuple[Line, ...]
    starts: Cycles
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
    cycles_of: dict[str, list[int]] = {kind: [] for kind in "SUTE"}
    ready: list[tuple[int, int]] = []
    violations = -1
    chip: list[tuple[int, int]] = []
    programs: list[tuple[int, int]] = []
    events: list[tuple[int, int]] = []
    faults: list[tuple[int, int, int]] = []
    lines: list[Line] = []
    bytes_at: list[int] = []
    data = bytearray()
    for line in text.splitlines():
        cycle, kind, *rest = line.split()
        time = int(cycle)
        if kind == "X":
            raise SimulationFailed(f"unknown value (X) at the board's pins in cycle {time}")
        if kind in cycles_of:
            cycles_of[kind].append(time)
        elif kind == "R":
            ready.append((time, int(rest[0])))
        elif kind == "F":
            faults.append((time, int(rest[0], 16), int(rest[1], 16)))
        elif kind == "N":
            events.append((time, int(rest[0], 16)))
        elif kind == "V":
            violations = int(rest[0])
        elif kind == "C":
            chip.append((time, int(rest[0])))
        elif kind == "P":
            programs.append((time, int(rest[0])))
        elif kind == "B":
            bytes_at.append(time)
            data.append(int(rest[0], 16))
        elif kind == "L":
            a, b, c, slot = (int(v) for v in rest[1:])
            lines.append(Line(time, rest[0] == "1", (a, b, c), slot))
    if violations < 0:
        raise SimulationFailed("the board's bench did not come to its end")

    def cycles(kind: str) -> Cycles:
        return np.array(cycles_of[kind], dtype=np.int64)

    return Trace(
        ready=np.array(ready, dtype=np.int64).reshape(-1, 2),
        samples=cycles("S"),
        updates=cycles("U"),
        starts=cycles("T"),
        framing_errors=cycles("E"),
        select=_selections(chip),
        programs=np.array(programs, dtype=np.int64).reshape(-1, 2),
        faults=faults,
        events=events,
        lines=tuple(lines),
        bytes_at=np.array(bytes_at, dtype=np.int64),
        data=bytes(data),
        violations=violations,
    )


def _selections(chip: list[tuple[int, int]]) -> Cycles:
    """First and last cycle of each time that the chip was selected, shape (n, 2)."""
    falls = [c for c, level in chip if not level]
    rises = [c for c, level in chip if level and falls and c > falls[0]]
    count = min(len(falls), len(rises))
    return np.array([falls[:count], rises[:count]], dtype=np.int64).T.reshape(-1, 2)
