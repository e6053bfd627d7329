"""Schedules: issue slots, cycles of the gets, length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from boresight.gateware.machine import Machine
from boresight.model.errors import InputError
from boresight.model.words.program import Program


class ScheduleError(InputError):
    """A program that does not fit the machine, or a schedule that breaks its rules."""


@dataclass(frozen=True)
class Slot:
    """One issue slot: one term, one capture or one emit of one lane.

    ``cycle`` is the cycle of stage 0. ``op`` numbers `Program.ops` (None: only an emit), ``term``
    its terms (None: the slot contributes nothing). ``a`` and ``b`` are the values on the two
    operand ports (``b`` None: table or nothing); with ``swap`` they are exchanged relative to the
    term. ``emit`` is the position in `Program.outputs` of the value ``a`` that is emitted.
    """

    cycle: int
    lane: int
    a: int
    b: int | None = None
    op: int | None = None
    term: int | None = None
    swap: bool = False
    cap_index: bool = False
    cap_flag: bool = False
    cap_norm: bool = False
    quarter: bool = False
    first: bool = False
    last: bool = False
    emit: int | None = None

    @property
    def reads_table(self) -> bool:
        """Whether the slot multiplies by a word of the tables."""
        return self.term is not None and self.b is None


@dataclass(frozen=True)
class Schedule:
    """A scheduled program.

    ``program`` is the lowered program (`gateware.schedule.copies`): the source program, ``source``
    its digest, with copies for states that need them. ``slots`` are in order of (cycle, lane),
    ``gets`` are the cycles at which the inputs are written, ``length`` counts the ROM words.
    ``urgent`` is the number of leading outputs whose latency was minimised first.
    """

    program: Program
    source: str
    machine: Machine
    slots: tuple[Slot, ...]
    gets: tuple[int, ...]
    length: int
    urgent: int

    @cached_property
    def ends(self) -> dict[int, Slot]:
        """Last slot of every op."""
        return {s.op: s for s in self.slots if s.op is not None}  # later ones replace earlier ones

    @property
    def interval(self) -> int:
        """Cycles from the first word of a record to the first word of the next."""
        return self.length

    @property
    def latencies(self) -> tuple[int, ...]:
        """Cycles from the first input word to each output word, both counted."""
        read = self.machine.stages.read
        words = {s.emit: s.cycle + read + 1 for s in self.slots if s.emit is not None}
        return tuple(words[k] for k in range(len(self.program.outputs)))

    @property
    def latency(self) -> int:
        """Latency of the last urgent output."""
        return self.latencies[self.urgent - 1] if self.urgent else 0

    def write_cycle(self, op: int) -> int:
        """Cycle at whose end the result of an op is written."""
        return self.ends[op].cycle + self.machine.stages.write
