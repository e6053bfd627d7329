"""Frames on the serial line: their format; software for both ways, hardware to the line.

A frame is ``END body END``, with the bytes END and ESC of the body escaped as in SLIP (RFC 1055),
so that END occurs nowhere else: after any fault the next frame is decoded again. The END before a
frame ends garbage from noise; empty frames are ignored.

The body is one byte for the kind, words of ``(W + 7) // 8`` bytes (least significant first), and a
CRC-16 of all of that, least significant byte first: the frame check of HDLC and PPP (RFC 1662;
CRC-16/IBM-SDLC, polynomial 0x1021 reflected, initial value and final exclusive-or 0xFFFF). From the
host bits above the word's W are ignored; to the host words are sign-extended.

======== =================================== ========================================
kind     from the host                       reply, same kind
======== =================================== ========================================
RECORD   the words of an input record        the words of the output record
WRITE    register address, word              register address, when the word is written
READ     register address                    word of the register
ATTITUDE                                     sent by itself: attitudes of a board
SENSED                                       the same, and what they were computed from
======== =================================== ========================================

Boards that read their sensors themselves have no RECORD, boards that are fed by the host no
ATTITUDE and SENSED. Bits of a register address beyond those of the bus are ignored, and are 0 in
the reply.

Every good frame gets one reply, in order (a register read directly after a record may still give
its value before the end of that update). A frame that is damaged, of another kind or of the wrong
length is dropped without reply. One frame may be sent before the reply to the one before; a third
is dropped.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import Any

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.crc import catalog
from amaranth.lib.wiring import In, Out

from boresight.gateware.engine.engine import word_layout
from boresight.model.errors import require

END, ESC, END_ESCAPED, ESC_ESCAPED = 0xC0, 0xDB, 0xDC, 0xDD
#: Bytes and their escapes, that of ESC itself first.
_ESCAPES = ((bytes([ESC]), bytes([ESC, ESC_ESCAPED])), (bytes([END]), bytes([ESC, END_ESCAPED])))
_ILLEGAL = re.compile(rb"\xdb(?![\xdc\xdd])")

#: Check of a frame.
CRC = catalog.CRC16_IBM_SDLC(data_width=8)
#: Bytes of the check.
CRC_BYTES = 2


class Kind(IntEnum):
    """First byte of a frame's body. No kind needs an escape; 0 means no kind."""

    RECORD = 1
    WRITE = 2
    READ = 3
    ATTITUDE = 4
    SENSED = 5


def word_bytes(word: int) -> int:
    """Bytes of a word of ``word`` bits on the line."""
    return (word + 7) // 8


def encode(kind: int, words: Iterable[int], *, word: int) -> bytes:
    """A frame, from END to END. InputError: a signed word does not fit into ``word`` bits."""
    body: bytes = bytes([kind])
    half = 1 << word - 1
    for number, w in enumerate(words):
        wanted, fix = f"{-half} to {half - 1}", "keep the value within the range of its word"
        require(-half <= w < half, f"word {number} of a frame", wanted, w, fix)
        body += int(w).to_bytes(word_bytes(word), "little", signed=True)
    body += CRC.compute(body).to_bytes(CRC_BYTES, "little")
    for plain, escaped in _ESCAPES:
        body = body.replace(plain, escaped)
    return bytes([END]) + body + bytes([END])


class Decoder:
    """Decoder of frames from a board's bytes; ``dropped`` counts those neither empty nor good."""

    def __init__(self, *, word: int) -> None:
        self.word = word
        self.dropped = 0
        self._begun = b""

    def feed(self, data: bytes) -> Iterator[tuple[Kind, list[int]]]:
        """Yield kind and signed words of every good frame that ends in ``data``."""
        *frames, self._begun = (self._begun + data).split(bytes([END]))
        for frame in filter(None, frames):
            if body := self._body(frame):
                yield body
            else:
                self.dropped += 1

    def _body(self, frame: bytes) -> tuple[Kind, list[int]] | None:
        """Contents of a frame, None if it is damaged."""
        if _ILLEGAL.search(frame):
            return None
        for plain, escaped in reversed(_ESCAPES):
            frame = frame.replace(escaped, plain)
        size = word_bytes(self.word)
        check, body = int.from_bytes(frame[-CRC_BYTES:], "little"), frame[:-CRC_BYTES]
        if not body or (len(body) - 1) % size or body[0] not in set(Kind):
            return None
        words = (body[k : k + size] for k in range(1, len(body), size))
        signed = [int.from_bytes(word, "little", signed=True) for word in words]
        return (Kind(body[0]), signed) if CRC.compute(body) == check else None


#: A byte of a body, and whether it is the last.
body_layout = data.StructLayout({"data": 8, "last": 1})


#: Parts of a frame.
_Part = IntEnum("_Part", "BEGIN BODY CHECK_LOW CHECK_HIGH FINISH", start=0)


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
                m.d.sync += [byte.eq(crc.crc[:8]), literal.eq(0), full.eq(1)]
                m.d.sync += part.eq(_Part.CHECK_HIGH)
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
        sent, whole = Signal(name="sent"), Signal(name="whole")  # a byte; the last one of a word
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
        held, ready = Signal(self.word, name="held"), Signal(name="ready", init=1)
        last, answer = Signal(name="last"), Signal(name="answer")
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
