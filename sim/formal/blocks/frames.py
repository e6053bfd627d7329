"""Proof of the frames from end to end: `gateware.boards.framer` to `gateware.boards.unpack`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Cat, Elaboratable, Module, Mux, Signal

from boresight.gateware.boards.framer import Framer
from boresight.gateware.boards.frames import END, Kind, word_bytes
from boresight.gateware.boards.unpack import Unpacker
from boresight.sim.formal.blocks.crc import GOOD, shifts
from boresight.sim.formal.harness import reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["LENGTHS", "PROOFS", "Delivered"]

#: Words of a frame of each kind.
LENGTHS = {Kind.WRITE: 2, Kind.READ: 1}
#: Bits of a word; three bytes.
WORD = 18


class Delivered(Elaboratable):
    """Every frame arrives complete, once, with its kind and words, or is reported as dropped.

    The line between the two transfers every byte, at any pace; between frames there may be any
    framing errors.

    Parameters
    ----------
    framer : Framer
        One side.
    unpacker : Unpacker
        The other, for words of `WORD` bits and frames of `LENGTHS`.
    """

    def __init__(self, framer: Framer, unpacker: Unpacker) -> None:
        self.framer = framer
        self.unpacker = unpacker

    def elaborate(self, platform: Any) -> Module:
        """Source, frame, and the two buffers."""
        m = Module()
        framer, unpacker = self.framer, self.unpacker
        m.submodules.framer = (sending := Inside(framer, platform)).module
        m.submodules.unpacker = (taking := Inside(unpacker, platform)).module
        size = word_bytes(WORD)

        # A body: kind, words, the last byte marked; the number of bytes that have been taken.
        valid, byte = unknown(m, 1, "valid"), unknown(m, 8, "byte")
        ready, done = unknown(m, 1, "ready"), unknown(m, 1, "done")
        self.number = number = Signal(range(2 + 2 * size), name="number")
        self.kind = kind = Signal(8, name="kind_sent")
        self.length = length = Signal(2, name="length")  # words
        self.taken_byte = taken_byte = Signal(8, name="taken_byte")
        last = (number == length * size) & (number != 0)
        m.d.comb += [
            length.eq(Mux(kind == Kind.WRITE, 2, 1)),
            framer.i.valid.eq(valid),
            framer.i.payload.data.eq(byte),
            framer.i.payload.last.eq(last),
            framer.i.payload.raw.eq(0),
            framer.o.ready.eq(ready),
            Assume((number != 0) | (byte == Kind.WRITE) | (byte == Kind.READ)),
            unpacker.data.eq(framer.o.payload),
            unpacker.valid.eq(framer.o.valid & ready),
            unpacker.done.eq(done),
            unpacker.read.eq(unknown(m, 1, "read")),
            unpacker.index.eq(unknown(m, len(unpacker.index), "index")),
        ]
        waited, previous = Signal(name="waited"), Signal(9, name="stood")
        m.d.sync += [waited.eq(valid & ~framer.i.ready), previous.eq(Cat(valid, byte))]
        m.d.comb += Assume(~waited | (Cat(valid, byte) == previous))
        with m.If(valid & framer.i.ready):
            m.d.sync += [number.eq(number + 1), taken_byte.eq(byte)]
            with m.If(number == 0):
                m.d.sync += kind.eq(byte)

        # The framer stores one byte; its next part decides which.
        part, full, special = sending["part"], sending["full"], sending["special"]
        self.parts = tuple(part == k for k in range(5))
        begin, body, low, _, _ = self.parts
        self.full = full
        self.of_body = full & (body & (number != 0) | low)
        out = full & ready & (~special | sending["escaped"])
        finished = out & begin
        with m.If(finished):
            m.d.sync += number.eq(0)
        self._buffers(m, out=out & self.of_body, finished=finished, done=done, size=size)
        self._stored(m, taking, size=size)
        self._insides(m, sending, taking, size=size)
        return m

    def _buffers(self, m: Module, *, out: Any, finished: Any, done: Any, size: int) -> None:
        """The frame that is sent and the frame that waits."""
        unpacker, count = self.unpacker, max(LENGTHS.values())
        words = [Signal(WORD, name=f"word{k}") for k in range(count)]
        held = [Signal(WORD, name=f"held{k}") for k in range(count)]
        gathered = Signal(8 * size, name="bytes_sent")
        pending, held_kind = Signal(name="frame_waits"), Signal(2, name="held_kind")
        dropped = Signal(name="frame_dropped")
        self.gathered, self.words, self.held = gathered, words, held
        self.pending, self.held_kind = pending, held_kind
        self.seen = seen = Signal(range(2 + 2 * size), name="seen")  # bytes of the body
        kind, byte = self.kind, self.taken_byte
        m.d.sync += dropped.eq(0)
        with m.If(out):
            m.d.sync += seen.eq(seen + 1)
            with m.If(seen != 0):
                m.d.sync += gathered.eq(Cat(gathered[8:], byte))
            for k in range(count):
                with m.If(seen == size * (k + 1)):
                    m.d.sync += words[k].eq(Cat(gathered[8:], byte))
        with m.If(finished):
            m.d.sync += seen.eq(0)
        with m.If(done):
            m.d.sync += pending.eq(0)
        with m.If(finished):
            with m.If(~pending | done):
                m.d.sync += [
                    pending.eq(1),
                    held_kind.eq(kind),
                    *(h.eq(w) for h, w in zip(held, words, strict=True)),
                ]
            with m.Else():
                m.d.sync += dropped.eq(1)
        m.d.comb += [
            Assert(unpacker.pending == pending),
            Assert(~pending | (unpacker.kind == held_kind)),
            Assert(unpacker.dropped == dropped),
            reached(
                m,
                pending
                & (held_kind == Kind.WRITE)
                & (held[0][:8] == 0xC0)
                & (held[1][8:16] == 0xDB),
                "escaped_frame",
            ),
            reached(m, dropped, "one_too_many"),
        ]

    def _stored(self, m: Module, taking: Inside, *, size: int) -> None:
        """Both frames are in the unpacker's buffer, and are read from it."""
        unpacker, depth = self.unpacker, self.unpacker.depth
        half, place = taking["half"], taking["place"]
        seen, pending, held_kind = self.seen, self.pending, self.held_kind
        gathered, words, held = self.gathered, self.words, self.held
        for k in range(len(words)):
            for name, buffer_half, frame in (("sent", half, words), ("held", ~half, held)):
                stored = taking.word("buffer", k + Mux(buffer_half, depth, 0))
                is_stored = (
                    (seen > size * (k + 1))
                    if name == "sent"
                    else (pending & ((held_kind == Kind.WRITE) | (k == 0)))
                )
                m.d.comb += Assert(~is_stored | (stored == frame[k]))
        was_read, expected = Signal(name="looked"), Signal(WORD, name="wanted")
        m.d.sync += [
            was_read.eq(
                unpacker.read & pending & ((unpacker.index == 0) | (held_kind == Kind.WRITE))
            ),
            expected.eq(Array(held)[unpacker.index]),
        ]
        m.d.comb += [
            Assert(~was_read | (unpacker.word_data == expected)),
            Assert(~pending | (held_kind == Kind.WRITE) | (held_kind == Kind.READ)),
            *(
                Assert(
                    (place < n)
                    | (seen == self.length * size + 1)
                    | (taking["gathered"][8 * (size - n) :] == gathered[8 * (size - n) :])
                )
                for n in range(1, size)
            ),
        ]

    def _insides(self, m: Module, sending: Inside, taking: Inside, *, size: int) -> None:
        """State of the unpacker, by the framer's part: for induction."""
        number, seen, kind, length = self.number, self.seen, self.kind, self.length
        begin, body, low, high, finish = self.parts
        full, byte, literal = self.full, sending["byte"], sending["literal"]
        tx_crc, rx_crc = sending.parts["crc"].component, taking.parts["crc"].component
        tx, rx = ~tx_crc.crc, ~rx_crc.crc  # the registers
        ending = full & begin
        within = seen != 0
        checks = Mux(high, ~full, Mux(finish, 2 - full, Mux(ending, 2, 0)))
        m.d.comb += [
            Assert(sending["part"] < 5),
            Assert(taking["escaped"] == sending["escaped"]),
            Assert(~sending["escaped"] | (full & sending["special"])),
            Assert(~taking["bad"]),
            # State of the framer.
            Assert(~(begin & ~full) | (number == 0)),
            Assert(~body | (number <= length * size)),
            Assert(~(low | high | finish | ending) | (number == length * size + 1)),
            Assert((number == 0) | (kind == Kind.WRITE) | (kind == Kind.READ)),
            # Stored words.
            Assert(seen == number - self.of_body),
            Assert(~self.of_body | ((byte == self.taken_byte) & ~literal)),
            Assert(~(self.of_body & (number == 1)) | (self.taken_byte == kind)),
            Assert(~(full & (begin | (body & (number == 0)))) | ((byte == END) & literal)),
            Assert(~(full & high) | ((byte == tx_crc.crc[:8]) & ~literal)),
            Assert(~(full & finish) | ((byte == tx_crc.crc[8:]) & ~literal)),
            # State of the unpacker.
            Assert(taking["headed"] == within),
            Assert(~within | (taking["kind"] == kind)),
            Assert(within | ((taking["place"] == 0) & (taking["count"] == 0))),
            Assert(
                ~within | (checks != 0) | (seen == 1 + size * taking["count"] + taking["place"])
            ),
            Assert(taking["place"] < size),
            Assert((checks == 0) | ((taking["count"] == length) & (taking["place"] == checks))),
            # The two checks.
            Assert(~body | (number != 0) | (tx == 0xFFFF)),
            Assert(~(body & ~full & (number == 0)) | (rx == 0xFFFF)),
            Assert(~(self.of_body & (seen == 0)) | (rx == 0xFFFF)),
            Assert(
                ~((body & (number != 0)) | low) | (tx == Mux(full, shifts(rx, self.taken_byte), rx))
            ),
            Assert(~(high & full) | (rx == tx)),
            Assert(~((high & ~full) | (finish & full)) | (rx == shifts(tx, tx_crc.crc[:8]))),
            Assert(~(finish & ~full | ending) | (rx_crc.match_detected & (rx == GOOD))),
        ]


PROOFS = (
    Proof(
        name="frames.delivered",
        depth=8,
        induction=3,
        cover=range(40, 42),
        claim=f"Framer to Unpacker, words of {WORD} bits, frames of 1 and 2 words: every frame "
        "arrives whole, once, unchanged, whatever bytes it holds, or is reported as dropped if "
        "the one before still waits; the one that waits stays as it is",
        harness=lambda: Delivered(Framer(), Unpacker(word=WORD, lengths=LENGTHS)),
    ),
)
