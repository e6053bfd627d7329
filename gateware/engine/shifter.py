"""Arithmetic right shifter."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.bitwise import Bitwise, delayed, multiplex


class Shifter(wiring.Component):
    """``o = (i >> amount) ^ invert``: 32 positions, sign-extended, low bits of the result.

    Three levels, each one six-input look-up table per bit: by 0, 8, 16 or 24; by 0, 2, 4 or 6; by
    0 or 1 together with the inversion.

    **Latency** none, or with a register behind the first level 1 cycle from ``i`` and ``amount``,
    whose last bits wait in here, too.

    Parameters
    ----------
    registered : bool
        Whether a register is behind the first level.
    """

    def __init__(self, *, width_in: int, width_out: int, registered: bool = False) -> None:
        self.width_in = width_in
        self.width_out = width_out
        self.registered = registered
        super().__init__(
            {
                **({"en": In(1)} if registered else {}),
                "i": In(signed(width_in)),
                "amount": In(5),
                "invert": In(1),
                "o": Out(signed(width_out)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """The three levels."""
        m = Module()
        value, amount = self.i, self.amount
        # A level has only the bits that later levels can still reach.
        for name, low, reach in (("coarse", 3, 7), ("middle", 1, 1)):
            width = min(self.width_in, self.width_out + reach)
            m.submodules[name] = mux = Bitwise(function=multiplex, inputs=6, width=width)
            ways = [(value >> (k << low))[:width] for k in range(4)]
            output = mux.connect(m, *ways, *amount[low : low + 2])
            value = Signal(signed(width), name=f"{name}_o")
            m.d.comb += value.eq(output)
            if self.registered and name == "coarse":
                value = delayed(m, value, en=self.en, names=["coarse_out"])
                amount = delayed(m, amount[:low], en=self.en, names=["amount_out"])
        last = Mux(amount[0], value >> 1, value)
        m.d.comb += self.o.eq(last ^ self.invert.replicate(self.width_out))
        return m
