"""Proof of the check of frames: the CRC of `gateware.boards.frames` against shift registers."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Elaboratable, Module, Mux, Signal, Value
from amaranth.lib.crc import Parameters

from boresight.gateware.boards.frames import CRC
from boresight.sim.formal.harness import reached, unknown
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "AgainstShifts", "shifts"]

#: x^16 + x^12 + x^5 + 1 of RFC 1662, least significant bit first.
POLYNOMIAL = 0x8408
#: Remainder in the register after a body with its check.
GOOD = 0xF0B8


def shifts(register: Value, byte: Value) -> Value:
    """The register of RFC 1662 after the 8 bits of a byte, least significant first."""
    for k in range(8):
        register = Mux(register[0] ^ byte[k], POLYNOMIAL, 0) ^ register[1:]
    return register[:16]


class AgainstShifts(Elaboratable):
    """Eight bits at once are eight single shifts, as the standard draws them.

    Parameters
    ----------
    crc : amaranth.lib.crc.Parameters
        The check.
    """

    def __init__(self, crc: Parameters) -> None:
        self.crc = crc

    def elaborate(self, platform: Any) -> Module:
        """Any bytes at any time, restarts in between."""
        m = Module()
        m.submodules.dut = dut = self.crc.create()
        start, valid, byte = unknown(m, 1, "start"), unknown(m, 1, "valid"), unknown(m, 8, "byte")
        m.d.comb += [dut.start.eq(start), dut.valid.eq(valid), dut.data.eq(byte)]
        register = Signal(16, init=0xFFFF, name="register")
        with m.If(valid):
            m.d.sync += register.eq(shifts(Mux(start, 0xFFFF, register)[:16], byte))
        with m.Elif(start):
            m.d.sync += register.eq(0xFFFF)
        m.d.comb += [
            Assert(dut.crc == ~register),
            Assert(dut.match_detected == (register == GOOD)),
            reached(m, register == GOOD, "good"),
        ]
        return m


PROOFS = (
    Proof(
        name="crc.frames",
        depth=6,
        induction=2,
        cover=range(5, 7),
        claim="CRC-16 of the frames, any bytes and restarts: a byte is eight shifts of the "
        "register of RFC 1662, and a good body leaves the remainder 0xF0B8",
        harness=lambda: AgainstShifts(CRC),
    ),
)
