"""Registers: address, access, format, range, named bits; those of every core.

Addresses count words. If a bridge maps the bus into a memory, word address k is at byte 4 k, in the
low W bits of 32. A core's fixed registers follow its parameters; hardware decodes and texts
describe them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from boresight.gateware.machine import Machine
from boresight.model.tools.reading import Within

Whole = Annotated[int | None, Within(-(1 << 31), (1 << 32) - 1)]


class Access(StrEnum):
    """Access of the bus to a register, in the terms of CMSIS-SVD."""

    READ_ONLY = "read-only"
    WRITE_ONLY = "write-only"
    READ_WRITE = "read-write"


@dataclass(frozen=True)
class BitField:
    """Bits of a register, ``width`` from ``bit`` on. ``clear``: writing 1 clears it."""

    name: str
    bit: Annotated[int, Within(0, 31)]
    meaning: str
    clear: bool = False
    width: Annotated[int, Within(1, 32)] = 1

    @property
    def mask(self) -> int:
        return ((1 << self.width) - 1) << self.bit

    def of(self, word: int) -> int:
        return (word & self.mask) >> self.bit


@dataclass(frozen=True)
class Register:
    """One word of the bus.

    For parameters ``frac`` is the number of fraction bits, and ``minimum``, ``maximum`` and
    ``reset`` are the signed words of ``low``, ``high`` and the default, rounded as
    `Format.quantise` does. Limits are None for the other registers, whose words are unsigned
    unless they are ``signed``, and numbers of ``unit`` times 2^-frac if there is a ``frac``;
    ``reset`` is then the word after power-up, or the word that a register always reads.
    ``width`` is the number of bits, a word's if None; bits above it read 0, also of signed ones.
    ``names`` are those of the numbers 0, 1, ... of the register, if they have names.
    """

    name: str
    address: Annotated[int, Within(0, 4095)]
    access: Access
    meaning: str
    unit: str = ""
    frac: Annotated[int | None, Within(-128, 128)] = None
    low: float | None = None
    high: float | None = None
    minimum: Whole = None
    maximum: Whole = None
    reset: Whole = None
    fields: tuple[BitField, ...] = ()
    names: tuple[str, ...] = ()
    width: Annotated[int | None, Within(1, 32)] = None
    signed: bool | None = None

    @property
    def is_parameter(self) -> bool:
        """Whether the register is a parameter of the estimator."""
        return self.minimum is not None

    @property
    def is_live(self) -> bool:
        """Whether the word comes from the hardware and is read-only."""
        return self.access is Access.READ_ONLY and self.reset is None

    def field(self, name: str) -> BitField:
        """Field called ``name``; raises KeyError for others."""
        return {field.name: field for field in self.fields}[name]


#: First address, after those of parameters.
FIRST = Machine.PARAMETER_ADDRESSES

STATUS = Register(
    "status",
    FIRST,
    Access.READ_WRITE,
    "state of the core",
    fields=(
        BitField("saturated", 0, "a result has been clamped to its word", clear=True),
        BitField("framing", 1, "a record had the wrong length and was dropped", clear=True),
        BitField("idle", 2, "waiting for the first word of a record"),
        BitField("parity", 3, "which copy of the states is the current one"),
        BitField("beyond", 4, "an input word was beyond its declared range", clear=True),
    ),
)
UPDATES = Register("updates", FIRST + 1, Access.READ_ONLY, "completed updates, modulo 2^W")
BUILD_LOW = Register("build_low", FIRST + 2, Access.READ_ONLY, "build identifier, bits W-1 to 0")
BUILD_HIGH = Register("build_high", FIRST + 3, Access.READ_ONLY, "build identifier, bits 2W-1 to W")
FIXED = (STATUS, UPDATES, BUILD_LOW, BUILD_HIGH)
#: Number of the selected program; absent in a core of one program.
CHOICE = Register("program", FIRST + 4, Access.READ_WRITE, "number of the program that runs")
PROGRAM = CHOICE.address
RESTART = Register(
    "restart",
    FIRST + 5,
    Access.WRITE_ONLY,
    "any word: the next update of the selected program begins from its initial states",
)
#: Bits of a core's address.
ADDRESS_BITS = RESTART.address.bit_length()
