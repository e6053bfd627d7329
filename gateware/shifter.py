"""Arithmetic right shifter, combinational."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Module, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Shifter"]


class Shifter(wiring.Component):
    """``o = (i >> amount) ^ invert``: 32 positions, sign-extended, low bits of the result.

    Three levels for six-input look-up tables: four ways, four ways, two ways with the inversion.

    **Latency** none.

    Parameters
    ----------
    width_in : int
        Bits of the operand.
    width_out : int
        Bits of the result.

    Members
    -------
    i : In(signed(width_in))
        Operand.
    amount : In(5)
        Shift, 0..31.
    invert : In(1)
        Invert the result.
    o : Out(signed(width_out))
        Result.
    """

    #: Levels: lowest bit of the amount that each one takes, and how many bits.
    LEVELS = ((3, 2), (1, 2), (0, 1))

    def __init__(self, *, width_in: int, width_out: int) -> None:
        for name, value in (("width_in", width_in), ("width_out", width_out)):
            if not isinstance(value, int) or value < 2:
                raise ValueError(f"{name} must be an integer of at least 2, not {value!r}")
        self.width_in = width_in
        self.width_out = width_out
        super().__init__({
            "i": In(signed(width_in)),
            "amount": In(5),
            "invert": In(1),
            "o": Out(signed(width_out)),
        })

    def elaborate(self, platform: Any) -> Module:
        """The three levels."""
        m = Module()
        value: Value = self.i
        for low, bits in self.LEVELS:
            select = self.amount[low:low + bits]
            value = Array(value >> (k << low) for k in range(1 << bits))[select]
        m.d.comb += self.o.eq(value ^ self.invert.replicate(self.width_out))
        return m
