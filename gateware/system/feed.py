"""Where the words of an estimator's record come from on a board, by the names of its inputs.

The conductor has a memory of words; a record is a list of places in it. Sensors' words stand there
as the programs before the estimators gave them; words that never change are in it from the start;
and inputs that no sensor gives are registers of the bus (`gateware.bus.feed_registers`).
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
#: By this a second field stands behind the first: the one that is complete is held meanwhile.
HELD = 16
_MOST_CONSTANTS, MOST_REGISTERS = 8, 32


@dataclass(frozen=True)
class Fed:
    """Where a word of a record comes from.

    ``place`` in the memory; with ``absent``, that place instead where the update has no fresh field
    (``field``) or no new set of the registers (``registers``).
    """

    place: int
    absent: int | None = None
    field: bool = False
    registers: bool = False


@dataclass(frozen=True)
class Feed:
    """What the conductor's memory holds, and the records that are made of it.

    Attributes
    ----------
    records : tuple of tuple of Fed
        For each estimator, its streamed words.
    constants : tuple of int
        Words from place 16 on.
    registers : dict of str to Value
        Inputs that no sensor gives, by name, in the order of their registers.
    holds : bool
        Some estimator reads the last field where there is no fresh one.
    """

    records: tuple[tuple[Fed, ...], ...]
    constants: tuple[int, ...] = ()
    registers: Mapping[str, Value] = field(default_factory=dict)
    holds: bool = False

    @property
    def wide(self) -> bool:
        """Whether the memory has to have more than its first 16 places."""
        return bool(self.constants or self.registers or self.holds)


def feed_of(programs: Sequence[Program]) -> Feed:
    """The feed of a system's estimators.

    Raises
    ------
    ValueError
        More constants or registers than there are places, a register of two formats.
    """
    makers = _Maker()
    records = tuple(
        tuple(makers.fed(program, number) for number in program.streamed) for program in programs
    )
    return Feed(records, tuple(makers.constants), makers.registers, makers.holds)


class _Maker:
    """Gathers what the records need."""

    def __init__(self) -> None:
        self.constants: list[int] = []
        self.registers: dict[str, Value] = {}
        self.holds = False

    def constant(self, word: int) -> int:
        """Place of a word that never changes."""
        if word == 0:
            return ZERO
        if word not in self.constants:
            self.constants.append(word)
        if len(self.constants) > _MOST_CONSTANTS:
            raise ValueError(f"constants must be {_MOST_CONSTANTS} or fewer: {self.constants}")
        return _CONSTANTS + self.constants.index(word)

    def fed(self, program: Program, number: int) -> Fed:
        """Where one input comes from."""
        value, form = program.values[number], program.format(number)
        ports = dict(zip(program.inputs, program.in_ports, strict=False))
        port = ports.get(number, InPort(missing=0.0))
        if port.flags:
            place = self.constant(int(form.quantise(1.0)))
            by_field = any(PLACES.get(name, 0) in FIELD for name in port.flags)
            by_registers = not all(name in PLACES for name in port.flags)
            absent = ZERO if by_field or by_registers else None
            return Fed(place, absent, by_field, by_registers)
        if value.name not in PLACES:
            return Fed(REGISTERS + self._register(value))
        place = PLACES[value.name]
        if place not in FIELD:
            return Fed(place)
        if isinstance(port.missing, str):
            self.holds = True
            return Fed(place)
        return Fed(place, self.constant(int(form.quantise(port.missing or 0.0))), field=True)

    def _register(self, value: Value) -> int:
        """Number of the register that gives an input."""
        known = self.registers.setdefault(value.name, value)
        if known.frac != value.frac:
            raise ValueError(f"register {value.name} must have one format, not two")
        if len(self.registers) > MOST_REGISTERS:
            raise ValueError(f"registers must be {MOST_REGISTERS} or fewer")
        return list(self.registers).index(value.name)


def reset_word(value: Value) -> int:
    """What an input register holds at first: 0, or what of its range is nearest to it."""
    nearest = min(max(0.0, value.low), value.high)
    return int(Format(32, value.frac).quantise(nearest))
