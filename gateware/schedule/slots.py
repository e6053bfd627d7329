"""Schedules: issue slots, cycles of the gets, length; copies of states that need them.

The machine writes a next state as the result of a group. A state whose next value is something
else (itself, an input, a constant, or a result that already is another state's next value) gets a
copy: one group of one term, value * 2^k >> (k - G).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from boresight.gateware.machine import Machine
from boresight.model.errors import InputError
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Overflow, Program, Term, Value


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

    ``program`` is the lowered program (`gateware.schedule.slots`): the source program, ``source``
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


def copy_shift(word: int, arith: Arithmetic) -> int | None:
    """Shift that makes a product with the constant ``word`` a copy; None if impossible."""
    k = word.bit_length() - 1
    shift = k - arith.guard
    exact = word > 0 and word == 1 << k and k <= arith.word - 2
    return shift if exact and 0 <= shift <= arith.shift_max else None


def with_copies(program: Program) -> Program:
    """Return ``program`` with copies added after its values and ops.

    Outputs, saturation and states are those of ``program`` word for word.
    """
    arith = program.arithmetic
    values, ops = list(program.values), list(program.ops)
    names = {v.name for v in values}
    computed, states = set[int](), list[tuple[int, int]]()

    def add(value: Value) -> int:
        name = value.name
        while name in names:
            name += "_"
        values.append(replace(value, name=name))
        return len(values) - 1

    constants = program.of_kind(Kind.CONST)
    units = (n for n in constants if copy_shift(values[n].initial, arith) is not None)
    unit = next(units, None)
    for state, after in program.states:
        if values[after].kind is not Kind.OP or after in computed:
            if unit is None:
                frac = arith.guard
                unit = add(Value("one", Kind.CONST, frac, 1.0, 1.0, "constant", initial=1 << frac))
            shift = copy_shift(values[unit].initial, arith)
            assert shift is not None
            name, source = f"{values[state].name}.next", after
            after = add(replace(values[source], name=name, kind=Kind.OP, initial=0))
            ops.append(Op(after, (Term(source, unit, shift),), Overflow.WRAP))
        computed.add(after)
        states.append((state, after))
    return replace(program, values=tuple(values), ops=tuple(ops), states=tuple(states))
