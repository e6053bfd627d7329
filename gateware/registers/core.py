"""Registers of every core, after its parameters; decoded by hardware, described by texts."""

from __future__ import annotations

from boresight.gateware.machine import Machine
from boresight.gateware.registers.model import Access, BitField, Register

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
#: Address of `CHOICE`.
PROGRAM = CHOICE.address
RESTART = Register(
    "restart",
    FIRST + 5,
    Access.WRITE_ONLY,
    "any word: the next update of the selected program begins from its initial states",
)
#: Bits of a core's address.
ADDRESS_BITS = RESTART.address.bit_length()
