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
    constants: list[int] = []
    registers: dict[str, Value] = {}

    def constant(word: int) -> int:
        """Place of a constant."""
        if word == 0:
            return ZERO
        if word not in constants:
            constants.append(word)
        if len(constants) > _MOST_CONSTANTS:
            raise ValueError(f"constants must be {_MOST_CONSTANTS} or fewer: {constants}")
        return _CONSTANTS + constants.index(word)

    def fed(program: Program, number: int) -> tuple[Fed, bool]:
        """Source of an input, and whether it is the last field if there is no fresh one."""
        value, form = program.values[number], program.format(number)
        ports = dict(zip(program.inputs, program.in_ports, strict=False))
        port = ports.get(number, InPort(missing=0.0))
        if port.flags:
            address = constant(int(form.quantise(1.0)))
            by_field = any(PLACES.get(name, 0) in FIELD for name in port.flags)
            by_registers = not all(name in PLACES for name in port.flags)
            absent = ZERO if by_field or by_registers else None
            return Fed(address, absent, by_field, by_registers), False
        if value.name not in PLACES:
            registers.setdefault(value.name, value)
            return Fed(REGISTERS + list(registers).index(value.name)), False
        address = PLACES[value.name]
        holds = address in FIELD and isinstance(port.missing, str)
        if holds or address not in FIELD:
            return Fed(address), holds
        missing = float(port.missing or 0.0)
        return Fed(address, constant(int(form.quantise(missing))), field=True), False

    sources = [[fed(program, number) for number in program.inputs] for program in programs]
    records = tuple(tuple(source for source, _ in record) for record in sources)
    holds = any(holds for record in sources for _, holds in record)
    return Feed(records, tuple(constants), registers, holds)


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
    inertial, field, compass : int
        Numbers of `FRONT_NAMES`.
    """

    word: int
    names: tuple[str, ...]
    filters: int
    lengths: tuple[int, ...]
    outputs: tuple[int, ...]
    feed: Feed
    count_bits: int
    early: bool
    inertial: int
    field: int
    compass: int


def plan_of(core: Core) -> Plan:
    """The plan of a core of `system_core`: estimators first, then `FRONT_NAMES`."""
    programs = [part.program for part in core.parts]
    schedules = [part.schedule for part in core.parts]
    filters = len(programs) - len(FRONT_NAMES)
    inertial = programs[filters]
    return Plan(
        programs[0].arithmetic.word,
        tuple(p.name for p in programs),
        filters,
        tuple(s.length for s in schedules),
        tuple(len(p.outputs) for p in programs[:filters]),
        feed_of(programs[:filters]),
        inertial.format(inertial.inputs[0]).frac,
        any(min(s.latencies) - 1 <= max(s.gets) for s in schedules),
        *range(filters, len(programs)),
    )
