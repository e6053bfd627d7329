"""Registers of every core, after its parameters: what hardware decodes and texts describe."""

from __future__ import annotations

from boresight.gateware.registers.model import Access, BitField, Register

__all__ = ["FIXED", "PROGRAM", "program_choice"]

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
#: Address of the register that says which program runs; with one program there is none.
PROGRAM = 516


def program_choice(names: tuple[str, ...]) -> Register:
    """The register that says which program runs."""
    meaning = "number of the program that runs"
    return Register("program", PROGRAM, Access.READ_WRITE, meaning, names=names)
