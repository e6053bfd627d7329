"""Bit-wise functions that must be one look-up table per bit, and registers in a row."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Const, Instance, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.dsp48a1 import is_spartan6


class Bitwise(wiring.Component):
    """A function of up to six words, bit by bit.

    On Spartan-6 each bit is one LUT primitive. Logic synthesis left alone makes two tables of many
    six-input functions, because it prices a LUT6 above a LUT5, and it chains tables on paths whose
    delay it does not know (from block RAM). Elsewhere it is left to synthesis.

    **Latency** none.

    Parameters
    ----------
    function : callable
        The function of as many words as it has inputs, made of ``~ & | ^`` only.
    """

    def __init__(self, *, function: Callable[..., Any], inputs: int, width: int = 1) -> None:
        self.function = function
        self.inputs = inputs
        self.width = width
        super().__init__({"i": In(width).array(inputs), "o": Out(width)})

    @property
    def table(self) -> int:
        """Contents of the look-up table: bit n is the function of the bits of n."""
        bits = [[n >> k & 1 for k in range(self.inputs)] for n in range(1 << self.inputs)]
        return sum((self.function(*row) & 1) << n for n, row in enumerate(bits))

    def elaborate(self, platform: Any) -> Module:
        """One table per bit, or the function."""
        m = Module()
        words = [self.i[k] for k in range(self.inputs)]
        if not is_spartan6(platform):
            m.d.comb += self.o.eq(self.function(*words))
            return m
        init = Const(self.table, 1 << self.inputs)
        for bit in range(self.width):
            pins = {f"i_I{k}": word[bit] for k, word in enumerate(words)}
            m.submodules[f"bit{bit}"] = Instance(
                f"LUT{self.inputs}", p_INIT=init, **pins, o_O=self.o[bit]
            )
        return m

    def connect(self, m: Module, *words: Any) -> Any:
        """Connect the inputs, one-bit values to every bit; returns the output."""
        for port, value in zip((self.i[k] for k in range(self.inputs)), words, strict=True):
            m.d.comb += port.eq(value.replicate(self.width) if len(value) == 1 else value)
        return self.o


def choose(select: Any, high: Any, low: Any) -> Any:
    """``select ? one : zero``, bit by bit."""
    return select & high | ~select & low


def next_value(register: Signal, value: Value, *, when: Value) -> Value:
    """``when ? value : register``, which synthesis does not make part of the clock enable.

    The enable comes late and needs no table more on its way to the register.
    """
    return choose(when.replicate(len(register)), value, register)


def multiplex(w0: Any, w1: Any, w2: Any, w3: Any, s0: Any, s1: Any) -> Any:
    """Four-way multiplexer, bit by bit."""
    return choose(s1, choose(s0, w3, w2), choose(s0, w1, w0))


def delayed(m: Module, value: Value, *, en: Value, names: list[str]) -> Value:
    """The value of as many enabled cycles before as there are ``names``, those of the registers."""
    for name in names:
        register = Signal(value.shape(), name=name, reset_less=True)
        with m.If(en):
            m.d.sync += register.eq(value)
        value = register
    return value
