"""Output records and replies to the bodies of frames."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.framer import body_layout
from boresight.gateware.boards.frames import Kind, word_bytes
from boresight.gateware.engine.engine import word_layout


def reply_layout(word: int) -> data.StructLayout:
    """Payload of the stream of replies to register accesses."""
    return data.StructLayout({"data": word, "kind": 2})


class Packer(wiring.Component):
    """Converts records and replies to bodies of frames (`gateware.boards.frames`), records first.

    A reply is taken with the last of its bytes. A record's word is stored when it is taken, and
    ``i.ready`` is registered.

    **Latency** 1 cycle from the first word to the first byte.
    """

    def __init__(self, *, word: int, records: bool = True) -> None:
        self.word = word
        self.records = records
        super().__init__(
            {
                # Output records.
                **({"i": In(stream.Signature(word_layout(word)))} if records else {}),
                "i_reply": In(stream.Signature(reply_layout(word))),  # Bodies of one word.
                "o": Out(stream.Signature(body_layout)),  # Bodies.
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Kind, then the words byte by byte."""
        m = Module()
        size, reply = word_bytes(self.word), self.i_reply
        place = Signal(range(size))
        word = Signal(8 * size)  # sign-extended
        kind = Signal.like(reply.payload.kind)
        sent = Signal()  # a byte
        whole = Signal()  # the last byte of a word
        m.d.comb += [
            word.eq(reply.payload.data.as_signed()),
            kind.eq(reply.payload.kind),
            sent.eq(self.o.valid & self.o.ready),
            whole.eq(place == size - 1),
        ]
        if self.records:
            self._states(m, place, word, kind, sent=sent, whole=whole)
            return m

        head = Signal(init=1)  # the next byte is the kind
        m.d.comb += [
            self.o.valid.eq(reply.valid),
            self.o.payload.data.eq(Mux(head, kind, word.word_select(place, 8))),
            self.o.payload.last.eq(whole & ~head),
            reply.ready.eq(self.o.ready & whole & ~head),
        ]
        with m.If(sent):
            m.d.sync += head.eq(self.o.payload.last)
            with m.If(~head):
                m.d.sync += place.eq(Mux(whole, 0, place + 1))
        return m

    def _states(
        self, m: Module, place: Signal, word: Signal, kind: Signal, *, sent: Value, whole: Value
    ) -> None:
        """Records and replies in turn: ``word`` and ``kind`` are a record's, or the reply's."""
        reply = self.i_reply
        held = Signal(self.word)
        last = Signal()
        ready = Signal(init=1)
        answer = Signal()
        taken = [held.eq(self.i.payload.data), last.eq(self.i.payload.last), ready.eq(0)]
        m.d.comb += self.i.ready.eq(ready)
        with m.If(~answer):
            m.d.comb += [word.eq(held.as_signed()), kind.eq(Kind.RECORD)]

        with m.FSM():
            with m.State("IDLE"):
                m.d.sync += place.eq(0)
                with m.If(self.i.valid):
                    m.d.sync += [*taken, answer.eq(0)]
                    m.next = "KIND"
                with m.Elif(reply.valid):
                    m.d.sync += [last.eq(1), ready.eq(0), answer.eq(1)]
                    m.next = "KIND"
            with m.State("KIND"):
                m.d.comb += [self.o.valid.eq(1), self.o.payload.data.eq(kind)]
                with m.If(sent):
                    m.next = "WORD"
            with m.State("WORD"):
                m.d.comb += [
                    self.o.valid.eq(1),
                    self.o.payload.last.eq(whole & last),
                    self.o.payload.data.eq(word.word_select(place, 8)),
                    reply.ready.eq(sent & whole & answer),
                ]
                with m.If(sent):
                    m.d.sync += place.eq(place + 1)
                    with m.If(whole):
                        m.d.sync += [ready.eq(1), place.eq(0)]
                        m.next = "NEXT"
                        with m.If(last):
                            m.next = "IDLE"
            with m.State("NEXT"), m.If(self.i.valid):
                m.d.sync += taken
                m.next = "WORD"
