"""The core of a complete system: estimators, the programs before them, and the plan of both.

The core has the estimators, then the three programs of `model.attitude.front`. The update
controller has a memory of words; a record is a list of places in it. The programs before the
estimators write the sensors' words there; constants are in it from the start; and inputs without a
sensor are registers of the bus.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from boresight.gateware.core import Core, build_shared_core
from boresight.model.attitude.front import FRONT, SENSED, Sensed, board_params
from boresight.model.declarations import Input, SourceFormat
from boresight.model.errors import placed, require, require_choice
from boresight.model.estimator import Estimator, with_params
from boresight.model.resolve import Named, estimator_of
from boresight.model.words.fixed import Format
from boresight.model.words.program import InPort, Program, Value

#: Bits of a word of a complete system.
WORD = 32
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
    """Contents of the update controller's memory, and the records read from it."""

    records: tuple[tuple[Fed, ...], ...]  #: for each estimator, its streamed words
    constants: tuple[int, ...]  #: words from place 16 on
    registers: Mapping[str, Value]  #: inputs without a sensor, in the order of their registers
    holds: bool  #: an estimator reads the last field if there is no fresh one

    @property
    def wide(self) -> bool:
        """Whether the memory needs more than its first 16 places."""
        return bool(self.constants or self.registers or self.holds)


def feed_of(programs: Sequence[Program]) -> Feed:
    """Input routing of a system's estimators."""
    constants: list[int] = []
    registers: dict[str, Value] = {}

    def constant(word: int) -> int:
        if word == 0:
            return ZERO
        if word not in constants:
            constants.append(word)
        require(
            len(constants) <= _MOST_CONSTANTS,
            "estimators",
            f"{_MOST_CONSTANTS} or fewer different values of missing= on a board",
            f"{len(constants)} or more",
            "use missing=0 or missing='hold', or leave estimators out",
        )
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
    return int(Format(WORD, value.frac).quantise(nearest))


#: The programs before the estimators, in the order of their numbers, which follow theirs.
FRONT_NAMES = ("calibrate_inertial", "calibrate_field", "compass_field")
#: Raw words of an inertial sample.
RAW = (*(f"{s}{a}_counts" for s in "ga" for a in "xyz"), "stamp", "restart")


@dataclass(frozen=True)
class Plan:
    """The programs of a core, for the update controller."""

    names: tuple[str, ...]  #: of the programs, by number
    filters: int  #: number of estimators, which come first
    lengths: tuple[int, ...]  #: cycles of each program
    outputs: tuple[int, ...]  #: words of each estimator's output record
    feed: Feed
    count_bits: int  #: fraction bits of raw counts in the input words
    early: bool  #: an estimator emits a word before it has taken the last word of its record
    inertial: int  #: with the next two, numbers of `FRONT_NAMES`
    field: int
    compass: int


def plan_of(core: Core) -> Plan:
    """The plan of a core of `system_core`: estimators first, then `FRONT_NAMES`."""
    programs = [part.program for part in core.parts]
    schedules = [part.schedule for part in core.parts]
    filters = len(programs) - len(FRONT_NAMES)
    inertial = programs[filters]
    return Plan(
        tuple(p.name for p in programs),
        filters,
        tuple(s.length for s in schedules),
        tuple(len(p.outputs) for p in programs[:filters]),
        feed_of(programs[:filters]),
        inertial.format(inertial.inputs[0]).frac,
        any(min(s.latencies) - 1 <= max(s.gets) for s in schedules),
        *range(filters, len(programs)),
    )


#: Most words of a record on a board, and most estimators.
_MOST_WORDS, _MOST = 16, 8


def system_estimators(filters: Sequence[Named]) -> list[Estimator]:
    """Estimators, then the programs before them: in the order of their numbers in the core.

    Inputs with a sensor, by name, have the format of its words; inputs of one name without a sensor
    share a register.

    `InputError`: unknown name; an input whose unit is not the sensor's, whose range does not hold
    the sensor's, or that does not say what it reads between two samples; too many words.
    """
    chosen = [estimator_of(f) for f in filters]
    front = [FRONT[name]() for name in FRONT_NAMES]
    count = len(chosen)
    require(count <= _MOST, "estimators", f"{_MOST} or fewer on a board", count, "leave some out")
    formats: dict[str, int] = {}
    for program in (e.compile(word=WORD) for e in front):
        outputs = zip(program.output_names, program.outputs, strict=True)
        formats |= {name: program.format(n).frac for name, n in outputs}
    registers: dict[str, Input] = {}
    fed = [_fed(e, formats, registers) for e in chosen]
    require(
        len(registers) <= MOST_REGISTERS,
        "estimators",
        f"{MOST_REGISTERS} or fewer inputs without a sensor",
        f"{len(registers)}: {', '.join(registers)}",
        "give them fewer, or the names of what the sensors give",
    )
    return [*fed, *front]


def _fed(
    estimator: Estimator, formats: Mapping[str, int], registers: dict[str, Input]
) -> Estimator:
    """The estimator with its inputs in the formats that they come in."""
    where = f"estimator {estimator.name}"
    inputs = []
    for i in estimator.inputs:
        if i.flags:
            inputs.append(i)
        elif i.name in SENSED:
            inputs.append(_sensed(i, SENSED[i.name], formats[i.name], where))
        else:
            first = registers.setdefault(i.name, i)
            form = Format.declared(WORD, first.low, first.high, first.unit)
            words = SourceFormat(form.frac, first.low, first.high)
            source = f"the input register {i.name}"
            inputs.append(_reading(i, words, source, first.unit, where))
    for kind, count in (("inputs", len(inputs)), ("outputs", len(estimator.outputs))):
        wanted = f"{_MOST_WORDS} or fewer {kind} on a board"
        require(count <= _MOST_WORDS, where, wanted, count, "pack them, or say --top records")
    fed = copy.copy(estimator)
    fed.inputs = tuple(inputs)
    return fed


def _sensed(i: Input, sensor: Sensed, frac: int, where: str) -> Input:
    """An input with the words of a sensor."""
    require(
        sensor.always or i.missing is not None,
        f"{where}, input {i.name}",
        "what it reads between two lines of the compass",
        "neither missing=NUMBER nor missing='hold'",
        "declare it",
    )
    # A time step below the range asks for a restart, one above it comes after a gap.
    clamped = replace(i, clamp=True) if i.name == "dt" else i
    words = SourceFormat(frac, sensor.low, sensor.high)
    sensed = _reading(clamped, words, "the sensor", sensor.unit, where)
    return i if sensed is clamped else sensed


def _reading(i: Input, words: SourceFormat, of: str, unit: str, where: str) -> Input:
    """The input as it reads words of a source called ``of``.

    InputError: the unit differs, or the range exceeds the input's and ``clamp`` is False.
    """
    place = placed(i.line, f"{where}, input {i.name}")
    fix = "declare the input in that unit, and convert in step"
    require(unit == i.unit, place, f"the unit of {of}, {unit or 'none'}", i.unit or None, fix)
    result = replace(i, source_format=words)
    wanted = f"a range that holds [{words.low:g}, {words.high:g}] of {of}"
    fix = "widen it, or declare clamp=True"
    require(i.clamp or not result.beyond, place, wanted, (i.low, i.high), fix)
    form = Format.declared(WORD, i.low, i.high, i.unit)
    return i if words.frac == form.frac and not result.beyond else result


def system_core(
    filters: Sequence[Named],
    *,
    config: str = "small",
    word: int = WORD,
    clock_hz: float = 100e6,
    params: Mapping[str, Mapping[str, float]] | None = None,
) -> Core:
    """Compile the core of a system. Estimator k is program k; the front programs follow.

    ``filters`` have any inputs and outputs; ``config`` is "small" or "fast", or with more registers
    "small-1024" and so on; time stamps count cycles of ``clock_hz`` (``tick_s``); ``params`` are
    values other than the defaults, by program.

    `InputError`: see `system_estimators`; unknown name of a program with parameters, of a parameter
    or configuration; a word of other than 32 bits. `ScheduleError`: the programs do not fit the
    machine.
    """
    wanted = f"{WORD} bits for a complete system"
    require(word == WORD, "word", wanted, word, "leave --word out, or say --top records")
    estimators = system_estimators(filters)
    for name in params or {}:
        require_choice(
            f"parameters of {name}",
            name,
            (e.name for e in estimators),
            "leave them out, or add the filter",
        )
    values = {"calibrate_inertial": {"tick_s": 1.0 / clock_hz}}
    for e in estimators:
        values[e.name] = {**values.get(e.name, {}), **board_params(e.params)}
    for name, overrides in (params or {}).items():
        values[name] = {**values.get(name, {}), **overrides}
    programs = [with_params(e.compile(word=WORD), e, values.get(e.name)) for e in estimators]
    return build_shared_core(programs, config)
