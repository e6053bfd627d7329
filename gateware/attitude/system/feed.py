"""Input routing: sources of the words of an estimator's record on a board, by names of inputs.

The update controller has a memory of words; a record is a list of places in it. The programs before
the estimators write the sensors' words there; constants are in it from the start; and inputs
without a sensor are registers of the bus (`gateware.attitude.bus.feed_registers`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from boresight.model.words.fixed import Format
from boresight.model.words.program import InPort, Program, Value

#: Places: gyro, accelerometer, time step; the field; a zero; constants; registers.
PLACES = {
    **{f"g{a}": k for k, a in enumerate("xyz")},
    **{f"a{a}": 3 + k for k, a in enumerate("xyz")},
    "dt": 6,
    **{f"m{a}": 8 + k for k, a in enumerate("xyz")},
}
FIELD, ZERO = (8, 9, 10), 15
_CONSTANTS, REGISTERS = 16, 32
#: Offset of a second copy of the field: the complete one is held while the other is written.
HELD = 16
_MOST_CONSTANTS, MOST_REGISTERS = 8, 32


@dataclass(frozen=True)
class Fed:
    """Source of a word of a record.

    ``place`` is that in the memory; ``absent`` replaces it in updates without a fresh field
    (``field``) or without a new set of registers (``registers``).
    """

    place: int
    absent: int | None = None
    field: bool = False
    registers: bool = False


@dataclass(frozen=True)
class Feed:
    """Contents of the update controller's memory, and the records read from it.

    Attributes
    ----------
    records : tuple of tuple of Fed
        For each estimator, its streamed words.
    constants : tuple of int
        Words from place 16 on.
    registers : dict of str to Value
        Inputs without a sensor, by name, in the order of their registers.
    holds : bool
        Whether an estimator reads the last field if there is no fresh one.
    """

    records: tuple[tuple[Fed, ...], ...]
    constants: tuple[int, ...] = ()
    registers: Mapping[str, Value] = field(default_factory=dict)
    holds: bool = False

    @property
    def wide(self) -> bool:
        """Whether the memory needs more than its first 16 places."""
        return bool(self.constants or self.registers or self.holds)


def feed_of(programs: Sequence[Program]) -> Feed:
    """Input routing of a system's estimators.

    Raises
    ------
    ValueError
        Too many constants or registers, or a register of two formats.
    """
    builder = _FeedBuilder()
    records = tuple(
        tuple(builder.fed(program, number) for number in program.inputs) for program in programs
    )
    return Feed(records, tuple(builder.constants), builder.registers, builder.holds)


class _FeedBuilder:
    """Collects constants and registers of the records."""

    def __init__(self) -> None:
        self.constants: list[int] = []
        self.registers: dict[str, Value] = {}
        self.holds = False

    def constant(self, word: int) -> int:
        """Place of a constant."""
        if word == 0:
            return ZERO
        if word not in self.constants:
            self.constants.append(word)
        if len(self.constants) > _MOST_CONSTANTS:
            raise ValueError(f"constants must be {_MOST_CONSTANTS} or fewer: {self.constants}")
        return _CONSTANTS + self.constants.index(word)

    def fed(self, program: Program, number: int) -> Fed:
        """Source of an input."""
        value, form = program.values[number], program.format(number)
        ports = dict(zip(program.inputs, program.in_ports, strict=False))
        port = ports.get(number, InPort(missing=0.0))
        if port.flags:
            address = self.constant(int(form.quantise(1.0)))
            by_field = any(PLACES.get(name, 0) in FIELD for name in port.flags)
            by_registers = not all(name in PLACES for name in port.flags)
            absent = ZERO if by_field or by_registers else None
            return Fed(address, absent, by_field, by_registers)
        if value.name not in PLACES:
            return Fed(REGISTERS + self._register(value))
        address = PLACES[value.name]
        if address not in FIELD:
            return Fed(address)
        if isinstance(port.missing, str):
            self.holds = True
            return Fed(address)
        return Fed(address, self.constant(int(form.quantise(port.missing or 0.0))), field=True)

    def _register(self, value: Value) -> int:
        """Number of an input's register."""
        register = self.registers.setdefault(value.name, value)
        if register.frac != value.frac:
            raise ValueError(f"register {value.name} must have one format, not two")
        if len(self.registers) > MOST_REGISTERS:
            raise ValueError(f"registers must be {MOST_REGISTERS} or fewer")
        return list(self.registers).index(value.name)


def reset_word(value: Value) -> int:
    """Initial word of an input register: 0, or the nearest value in its range."""
    nearest = min(max(0.0, value.low), value.high)
    return int(Format(32, value.frac).quantise(nearest))
