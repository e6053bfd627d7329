"""Two words between a source and a target, so that no path leads through."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.data import Layout
from amaranth.lib.wiring import In, Out

__all__ = ["StreamBuffer"]


class StreamBuffer(wiring.Component):
    """A buffer of two words: every output is a register, and a word can pass in each cycle.

    **Latency** 1 cycle.

    Parameters
    ----------
    layout : Layout
        Of a word.

    Members
    -------
    i : In(stream), o : Out(stream)
        Words.
    empty : Out(1)
        No word is inside.
    """

    def __init__(self, *, layout: Layout) -> None:
        self.layout = layout
        words = stream.Signature(layout)
        super().__init__({"i": In(words), "o": Out(words), "empty": Out(1)})

    def elaborate(self, platform: Any) -> Module:
        """The first word is on the output; the second waits while it is not taken."""
        m = Module()
        full = Signal()
        second = Signal(self.layout)
        m.d.comb += [self.i.ready.eq(~full), self.empty.eq(~self.o.valid)]
        with m.If(self.o.ready | ~self.o.valid):
            m.d.sync += [self.o.valid.eq(self.i.valid | full), full.eq(0)]
            m.d.sync += self.o.payload.eq(self.i.payload)
            with m.If(full):
                m.d.sync += self.o.payload.eq(second)
        with m.Elif(self.i.valid):
            m.d.sync += full.eq(1)
        with m.If(~full):
            m.d.sync += second.eq(self.i.payload)
        return m
