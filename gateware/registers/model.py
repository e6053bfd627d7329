"""A register map, declared once; `gateware.registers.files` has its written forms.

Addresses count words. Where a bridge puts the bus into a memory, word address k stands at byte 4 k,
in the low W bits of 32; the SVD says so.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from enum import StrEnum

from boresight.model.tools.c_names import unique

__all__ = ["Access", "BitField", "Port", "Register", "RegisterMap", "Streams"]


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
