"""Bodies to frames."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from gateware.boards.frames import CRC, END, END_ESCAPED, ESC, ESC_ESCAPED

__all__ = ["Framer", "body_layout"]

#: A byte of a body, or of text that goes as it is (``raw``), whether it is the last.
body_layout = data.StructLayout({"data": 8, "last": 1, "raw": 1})


class _Part(IntEnum):
    """Of a frame."""

    BEGIN = 0
    BODY = 1
    CHECK_LOW = 2
    CHECK_HIGH = 3
    FINISH = 4


class Framer(wiring.Component):
    """Adds END, escapes and the CRC to a body: `gateware.boards.frames`.

    Raw bytes pass as they are, outside frames: ``raw`` is the same for all bytes up to the last.

    **Latency** none: END goes out in the cycle in which the first byte is there, and nothing is
    stored but the CRC.

    Members
    -------
    i : In(stream of {data: 8, last: 1, raw: 1})
        Bodies, from the kind to the last word.
    o : Out(stream of 8)
        Bytes for the line.
    """

    def __init__(self) -> None:
        super().__init__({"i": In(stream.Signature(body_layout)), "o": Out(stream.Signature(8))})

    def elaborate(self, platform: Any) -> Module:
        """One state per part of a frame; the escape goes out before the byte that needs it."""
        m = Module()
        m.submodules.crc = crc = CRC.create()
        part = Signal(_Part)
        begin, body, literal, escaped = Signal(), Signal(), Signal(), Signal()
        byte, special, sent = Signal(8), Signal(), Signal()
        m.d.comb += [
            begin.eq((part == _Part.BEGIN) & ~self.i.payload.raw),
            body.eq((part == _Part.BODY) | self.i.payload.raw & (part == _Part.BEGIN)),
            literal.eq(begin | (part == _Part.FINISH) | self.i.payload.raw & body),
            special.eq(~literal & ((byte == END) | (byte == ESC))),
            self.o.valid.eq(self.i.valid | ~(begin | body)),
            self.o.payload.eq(Mux(~special, byte, Mux(
                ~escaped, ESC, Mux(byte == END, END_ESCAPED, ESC_ESCAPED)))),
            sent.eq(self.o.valid & self.o.ready & (~special | escaped)),
            self.i.ready.eq(body & self.o.ready & (~special | escaped)),
            crc.start.eq(begin),
            crc.data.eq(byte),
            crc.valid.eq(body & sent),
        ]
        with m.If(self.o.valid & self.o.ready):
            m.d.sync += escaped.eq(special & ~escaped)
        with m.Switch(part):
            with m.Case(_Part.CHECK_LOW):
                m.d.comb += byte.eq(crc.crc[:8])
            with m.Case(_Part.CHECK_HIGH):
                m.d.comb += byte.eq(crc.crc[8:])
            with m.Default():
                m.d.comb += byte.eq(Mux(body, self.i.payload.data, END))
        with m.If(sent):
            with m.Switch(part):
                with m.Case(_Part.BEGIN):
                    with m.If(begin):
                        m.d.sync += part.eq(_Part.BODY)
                with m.Case(_Part.BODY):
                    with m.If(self.i.payload.last):
                        m.d.sync += part.eq(_Part.CHECK_LOW)
                with m.Case(_Part.CHECK_LOW):
                    m.d.sync += part.eq(_Part.CHECK_HIGH)
                with m.Case(_Part.CHECK_HIGH):
                    m.d.sync += part.eq(_Part.FINISH)
                with m.Default():
                    m.d.sync += part.eq(_Part.BEGIN)
        return m
