"""Bodies to frames."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.frames import CRC, END, END_ESCAPED, ESC, ESC_ESCAPED

#: A byte of a body, and whether it is the last.
body_layout = data.StructLayout({"data": 8, "last": 1})


class _Part(IntEnum):
    """Parts of a frame."""

    BEGIN = 0
    BODY = 1
    CHECK_LOW = 2
    CHECK_HIGH = 3
    FINISH = 4


class Framer(wiring.Component):
    """Adds END, escapes and the CRC to a body: `gateware.boards.frames`.

    **Latency** 1 cycle from the first byte to END; a byte takes 2 cycles and what the line needs.
    """

    def __init__(self) -> None:
        super().__init__({"i": In(stream.Signature(body_layout)), "o": Out(stream.Signature(8))})

    def elaborate(self, platform: Any) -> Module:
        """One state per part of a frame; a byte is stored, then sent, an escape before it."""
        m = Module()
        m.submodules.crc = crc = CRC.create()
        part = Signal(_Part)
        byte = Signal.like(self.o.payload)
        literal, full, escaped = (Signal(name=name) for name in ("literal", "full", "escaped"))
        special = Signal()
        m.d.comb += [
            special.eq(~literal & ((byte == END) | (byte == ESC))),
            self.o.valid.eq(full),
            self.o.payload.eq(byte),
        ]
        with m.If(special):
            # Bit 0 distinguishes ESC from END.
            m.d.comb += self.o.payload.eq(Mux(escaped, Mux(byte[0], ESC_ESCAPED, END_ESCAPED), ESC))
        with m.If(full & self.o.ready):
            m.d.sync += [full.eq(special & ~escaped), escaped.eq(special & ~escaped)]

        m.d.comb += [
            self.i.ready.eq((part == _Part.BODY) & ~full),
            crc.start.eq(part == _Part.BEGIN),
            crc.data.eq(self.i.payload.data),
            crc.valid.eq(self.i.valid & self.i.ready),
        ]
        with m.If(~full), m.Switch(part):
            with m.Case(_Part.CHECK_LOW):
                m.d.sync += [
                    byte.eq(crc.crc[:8]),
                    literal.eq(0),
                    full.eq(1),
                    part.eq(_Part.CHECK_HIGH),
                ]
            with m.Case(_Part.CHECK_HIGH):
                m.d.sync += [byte.eq(crc.crc[8:]), full.eq(1), part.eq(_Part.FINISH)]
            with m.Case(_Part.BODY):
                m.d.sync += [byte.eq(self.i.payload.data), literal.eq(0), full.eq(self.i.valid)]
                with m.If(self.i.valid & self.i.payload.last):
                    m.d.sync += part.eq(_Part.CHECK_LOW)
            with m.Case(_Part.BEGIN):
                m.d.sync += [byte.eq(END), literal.eq(1), full.eq(self.i.valid)]
                with m.If(self.i.valid):
                    m.d.sync += part.eq(_Part.BODY)
            with m.Default():  # FINISH, and unused codes
                m.d.sync += [byte.eq(END), literal.eq(1), full.eq(1), part.eq(_Part.BEGIN)]
        return m
