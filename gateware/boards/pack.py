"""Output records and answers to bytes."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from gateware.boards.frames import CRC, END, END_ESCAPED, ESC, ESC_ESCAPED, Kind, word_bytes
from gateware.engine import word_layout

__all__ = ["Packer", "reply_layout"]


def reply_layout(word: int) -> data.StructLayout:
    """Payload of the stream of answers to register accesses."""
    return data.StructLayout({"data": word, "kind": 2})


class Packer(wiring.Component):
    """Makes frames (`gateware.boards.frames`) of records and answers; records go first.

    ``i.ready`` comes out of a flip-flop, and a word is stored when it is taken.

    **Latency** 1 cycle from the first word to the first byte.

    Parameters
    ----------
    word : int
        Bits of a word, W.

    Members
    -------
    i : In(stream of {data: W, last: 1})
        Output records.
    i_reply : In(stream of {data: W, kind: 2})
        Answers: frames of one word.
    o : Out(stream of 8)
        Bytes.
    """

    def __init__(self, *, word: int) -> None:
        self.word = word
        super().__init__({
            "i": In(stream.Signature(word_layout(word))),
            "i_reply": In(stream.Signature(reply_layout(word))),
            "o": Out(stream.Signature(8)),
        })

    def elaborate(self, platform: Any) -> Module:
        """One state per part of a frame; the escape goes out before the byte that needs it."""
        m = Module()
        size = word_bytes(self.word)
        m.submodules.crc = crc = CRC.create()
        rest = Signal(8 * size)  # of the word, sign-extended
        kind = Signal(2)
        last, ready, escaped = Signal(), Signal(init=1), Signal()
        left = Signal(range(size))
        byte, literal, sent = Signal(8), Signal(), Signal()

        special = Signal()
        m.d.comb += [
            special.eq(~literal & ((byte == END) | (byte == ESC))),
            self.o.payload.eq(Mux(~special, byte, Mux(
                ~escaped, ESC, Mux(byte == END, END_ESCAPED, ESC_ESCAPED)))),
            sent.eq(self.o.valid & self.o.ready & (~special | escaped)),
            crc.data.eq(byte),
            self.i.ready.eq(ready),
        ]
        with m.If(self.o.valid & self.o.ready):
            m.d.sync += escaped.eq(special & ~escaped)

        def store(word: Any) -> None:
            m.d.sync += [rest.eq(word.as_signed()), left.eq(size - 1), ready.eq(0)]

        with m.FSM():
            with m.State("IDLE"):
                m.d.comb += crc.start.eq(1)
                with m.If(self.i.valid):
                    store(self.i.payload.data)
                    m.d.sync += [kind.eq(Kind.RECORD), last.eq(self.i.payload.last)]
                    m.next = "BEGIN"
                with m.Elif(self.i_reply.valid):
                    m.d.comb += self.i_reply.ready.eq(1)
                    store(self.i_reply.payload.data)
                    m.d.sync += [kind.eq(self.i_reply.payload.kind), last.eq(1)]
                    m.next = "BEGIN"
            with m.State("BEGIN"):
                m.d.comb += [self.o.valid.eq(1), literal.eq(1), byte.eq(END)]
                with m.If(sent):
                    m.next = "KIND"
            with m.State("KIND"):
                m.d.comb += [self.o.valid.eq(1), byte.eq(kind), crc.valid.eq(sent)]
                with m.If(sent):
                    m.next = "WORD"
            with m.State("WORD"):
                m.d.comb += [self.o.valid.eq(1), byte.eq(rest[:8]), crc.valid.eq(sent)]
                with m.If(sent):
                    m.d.sync += [rest.eq(rest >> 8), left.eq(left - 1)]
                    with m.If(left == 0):
                        m.d.sync += ready.eq(~last)
                        m.next = "NEXT"
                        with m.If(last):
                            m.next = "CRC"
            with m.State("NEXT"), m.If(self.i.valid):
                store(self.i.payload.data)
                m.d.sync += last.eq(self.i.payload.last)
                m.next = "WORD"
            with m.State("CRC"):
                m.d.comb += [self.o.valid.eq(1), byte.eq(crc.crc)]
                with m.If(sent):
                    m.next = "FINISH"
            with m.State("FINISH"):
                m.d.comb += [self.o.valid.eq(1), literal.eq(1), byte.eq(END)]
                with m.If(sent):
                    m.d.sync += ready.eq(1)
                    m.next = "IDLE"
        return m
