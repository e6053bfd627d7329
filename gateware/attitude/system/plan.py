"""The plan of a system's core for the update controller: its programs, and their input routing.

The core of a complete system has the estimators, then the three programs of
`model.attitude.front`. The update controller has a memory of words; a record is a list of places in
it. The programs before the estimators write the sensors' words there; constants are in it from the
start; and inputs without a sensor are registers of the bus.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from boresight.gateware.core import Core
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
        Too many constants.
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
        self.registers.setdefault(value.name, value)
        return list(self.registers).index(value.name)


def reset_word(value: Value) -> int:
    """Initial word of an input register: 0, or the nearest value in its range."""
    nearest = min(max(0.0, value.low), value.high)
    return int(Format(32, value.frac).quantise(nearest))


#: The programs before the estimators, in the order of their numbers, which follow theirs.
FRONT_NAMES = ("calibrate_inertial", "calibrate_field", "compass_field")
_INERTIAL = tuple(f"{s}{a}" for s in "ga" for a in "xyz")
#: Raw words of an inertial sample.
RAW = (*(f"{name}_counts" for name in _INERTIAL), "stamp", "restart")
#: Widths of the words of a complete system, bits.
SYSTEM_WORDS = range(26, 33)


@dataclass(frozen=True)
class Plan:
    """The programs of a core, for the update controller.

    Attributes
    ----------
    word : int
        W.
    names : tuple of str
        Names of the programs, by number.
    filters : int
        Number of estimators, which come first.
    lengths : tuple of int
        Cycles of each.
    outputs : tuple of int
        Words of each estimator's output record.
    feed : Feed
        Input routing of their records.
    count_bits : int
        Fraction bits of raw counts in the input words.
    early : bool
        Whether an estimator emits a word before it has taken the last word of its record.
    """

    word: int
    names: tuple[str, ...]
    filters: int
    lengths: tuple[int, ...]
    outputs: tuple[int, ...]
    feed: Feed
    count_bits: int
    early: bool = False

    @property
    def inertial(self) -> int:
        """Number of `calibrate_inertial`."""
        return self.filters

    @property
    def field(self) -> int:
        """Number of `calibrate_field`."""
        return self.filters + 1

    @property
    def compass(self) -> int:
        """Number of `compass_field`."""
        return self.filters + 2


def plan_of(core: Core) -> Plan:
    """The plan of a core of `system_core`: estimators first, then `FRONT_NAMES`."""
    programs = [part.program for part in core.parts]
    schedules = [part.schedule for part in core.parts]
    filters = len(programs) - len(FRONT_NAMES)
    inertial = programs[filters]
    early = [min(s.latencies) - 1 <= max(s.gets) for s in schedules]
    return Plan(
        word=programs[0].arithmetic.word,
        names=tuple(p.name for p in programs),
        filters=filters,
        lengths=tuple(s.length for s in schedules),
        outputs=tuple(len(p.outputs) for p in programs[:filters]),
        feed=feed_of(programs[:filters]),
        count_bits=inertial.format(inertial.inputs[0]).frac,
        early=any(early),
    )
