"""The register map of a core, declared once; `gateware.registers.files` has its written forms.

The addresses are those of the core's bus (`gateware.bus.core_registers`): one per word. Where a
bridge puts the bus into a memory, word address k stands at byte 4 k, in the low W bits of 32; the
SVD says so.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from enum import StrEnum

from boresight.gateware.bus.core_registers import PROGRAM
from boresight.gateware.core import Core
from boresight.gateware.registers.names import unique
from boresight.model.words.program import Program

__all__ = ["Access", "BitField", "Port", "Register", "RegisterMap", "Streams", "register_map"]


class Access(StrEnum):
    """What the bus can do with a register, in the words of CMSIS-SVD."""

    READ_ONLY = "read-only"
    WRITE_ONLY = "write-only"
    READ_WRITE = "read-write"


@dataclass(frozen=True)
class BitField:
    """Bits of a register, ``width`` from ``bit`` on. ``clear``: writing 1 clears it."""

    name: str
    bit: int
    meaning: str
    clear: bool = False
    width: int = 1

    @property
    def mask(self) -> int:
        """These bits of the register."""
        return ((1 << self.width) - 1) << self.bit


@dataclass(frozen=True)
class Port:
    """One word of the input or output records: value = word * 2^-frac."""

    name: str
    frac: int
    unit: str


@dataclass(frozen=True)
class Streams:
    """The records of a program."""

    program: str
    digest: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]


@dataclass(frozen=True)
class Register:
    """One word of the bus.

    For parameters ``frac`` is the number of fraction bits, and ``minimum``, ``maximum`` and
    ``reset`` are the signed words of ``low``, ``high`` and the default, rounded as
    `Format.quantise` does. Limits are None for the other registers, whose words are unsigned
    unless they are ``signed``, and numbers of ``unit`` times 2^-frac if there is a ``frac``;
    ``reset`` is then the word after power-up, or the word that a register always reads.
    ``width`` is the number of bits, a word's if None; bits above it read 0, also of signed ones.
    ``names`` are those of the numbers 0, 1, ... that the register may hold, if they have names.
    """

    name: str
    address: int
    access: Access
    meaning: str
    unit: str = ""
    frac: int | None = None
    low: float | None = None
    high: float | None = None
    minimum: int | None = None
    maximum: int | None = None
    reset: int | None = None
    fields: tuple[BitField, ...] = ()
    names: tuple[str, ...] = ()
    width: int | None = None
    signed: bool | None = None

    @property
    def is_parameter(self) -> bool:
        """Whether it is a parameter of the estimator."""
        return self.minimum is not None


#: Registers of every core, after the parameters: what `gateware.bus.core_registers` decodes.
FIXED = (
    Register(
        "status",
        512,
        Access.READ_WRITE,
        "state of the core",
        fields=(
            BitField("saturated", 0, "a result has been clamped to its word", clear=True),
            BitField("framing", 1, "a record had the wrong length and was dropped", clear=True),
            BitField("idle", 2, "waiting for the first word of a record"),
            BitField("parity", 3, "which copy of the states is the current one"),
        ),
    ),
    Register("updates", 513, Access.READ_ONLY, "completed updates, modulo 2^W"),
    Register("build_low", 514, Access.READ_ONLY, "build identifier, bits W-1 to 0"),
    Register("build_high", 515, Access.READ_ONLY, "build identifier, bits 2W-1 to W"),
)


@dataclass(frozen=True)
class RegisterMap:
    """All registers of a core, and for each program the words of its streams.

    ``build`` holds the words that ``build_low`` and ``build_high`` read. With several programs the
    parameters' names begin with the program's: ``mekf.gain``. ``title`` says what has them: a core,
    or a system with more registers than the core's.
    """

    name: str
    digest: str
    word: int
    build: tuple[int, int]
    registers: tuple[Register, ...]
    streams: tuple[Streams, ...]
    title: str = "core"

    def mask_of(self, register: Register) -> int:
        """All bits of a register."""
        return (1 << (register.width or self.word)) - 1

    @property
    def mask(self) -> int:
        """All bits of a word."""
        return (1 << self.word) - 1

    @property
    def parameters(self) -> tuple[Register, ...]:
        """The estimator's parameters."""
        return tuple(r for r in self.registers if r.is_parameter)

    def find(self, name: str) -> Register:
        """The register called ``name``, a parameter before a fixed one; KeyError if none is."""
        for register in self.registers:
            if register.name == name:
                return register
        raise KeyError(name)

    @property
    def identifiers(self) -> dict[int, str]:
        """C identifier of every register, by address; unique even when case does not count."""
        ordered = sorted(self.registers, key=lambda r: r.is_parameter)  # the fixed names first
        names = unique(r.name for r in ordered)
        return {r.address: name for r, name in zip(ordered, names, strict=True)}

    def to_json(self) -> str:
        """The map as JSON, the same text for the same map."""

        def plain(register: Register) -> dict[str, object]:
            kept = {k: v for k, v in asdict(register).items() if v is not None and v != ()}
            return {**kept, "byte_offset": 4 * register.address}

        return (
            json.dumps(
                {
                    "name": self.name,
                    "title": self.title,
                    "digest": self.digest,
                    "word": self.word,
                    "build": self.build,
                    "registers": [plain(r) for r in self.registers],
                    "programs": [{"number": k, **asdict(s)} for k, s in enumerate(self.streams)],
                },
                indent=1,
            )
            + "\n"
        )


def register_map(core: Core) -> RegisterMap:
    """The register map of a compiled core."""
    word, several = core.machine.arithmetic.word, len(core.parts) > 1
    mask = (1 << word) - 1
    parameters = []
    for number, part in enumerate(core.parts):
        for name, address in core.select(number).parameter_addresses.items():
            full = f"{part.program.name}.{name}" if several else name
            parameters.append(_parameter(part.program, name, address, full))
    choice = Register(
        "program", PROGRAM, Access.READ_WRITE, "number of the program that runs", names=core.names
    )
    return RegisterMap(
        name=core.name,
        digest=core.digest,
        word=word,
        build=(core.image.digest & mask, core.image.digest >> word & mask),
        registers=(*parameters, *FIXED, *([choice] if several else [])),
        streams=tuple(_streams(part.program) for part in core.parts),
    )


def _parameter(program: Program, name: str, address: int, full: str) -> Register:
    number = program.find(name)
    value, form = program.values[number], program.format(number)
    return Register(
        full,
        address,
        Access.WRITE_ONLY,
        value.meaning or "parameter",
        unit=value.unit,
        frac=value.frac,
        low=value.low,
        high=value.high,
        minimum=int(form.quantise(value.low)),
        maximum=int(form.quantise(value.high)),
        reset=value.initial,
    )


def _streams(program: Program) -> Streams:
    outputs = zip(program.output_names, program.outputs, strict=True)
    units = {port.name: port.unit for port in program.ports}
    return Streams(
        program.name,
        program.digest,
        tuple(_port(program, program.values[n].name, n) for n in program.inputs),
        tuple(_port(program, name, n, units.get(name)) for name, n in outputs),
    )


def _port(program: Program, name: str, number: int, unit: str | None = None) -> Port:
    value = program.values[number]
    return Port(name, value.frac, value.unit if unit is None else unit)
