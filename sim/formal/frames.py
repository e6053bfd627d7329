"""Proof of the frames from end to end: `gateware.boards.framer` to `gateware.boards.unpack`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Elaboratable, Module, Signal

from boresight.gateware.boards.framer import Framer
from boresight.gateware.boards.frames import Kind, word_bytes
from boresight.gateware.boards.unpack import Unpacker
from boresight.sim.formal.harness import Harness, Stream, drive, fixed, reached
from boresight.sim.formal.prove import Proof

#: Bits of a word; three bytes.
WORD = 18


class Line(Elaboratable):
    """A framer, and an unpacker of frames of one word, at the two ends of a line."""

    def __init__(self) -> None:
        self.framer = Framer()
        self.unpacker = Unpacker(word=WORD, lengths={Kind.READ: 1, Kind.WRITE: 2})

    def elaborate(self, platform: Any) -> Module:
        """The two components; the harness is the line."""
        m = Module()
        m.submodules.framer = self.framer
        m.submodules.unpacker = self.unpacker
        return m


class FramesHarness(Harness[Line]):
    """Framer to Unpacker: every frame of one word arrives whole, once, or is reported as dropped.

    The word is any, with and without escapes. Neither the source nor the line pauses. A frame
    is dropped only if the one before it still waits.
    """

    def surround(self, m: Module, dut: Line) -> None:
        """Send the same frame again and again."""
        framer, unpacker = dut.framer, dut.unpacker
        word = fixed(m, WORD, "word")
        body = Array(
            [Kind.READ.value, *(word.as_signed() >> 8 * k for k in range(word_bytes(WORD)))]
        )
        number = Signal(range(len(body)))
        last = number == len(body) - 1
        i = framer.i
        byte = Signal(8)
        m.d.comb += [byte.eq(body[number]), i.payload.last.eq(last)]
        source = Stream(i.valid, i.ready, i.payload.data, name="body")
        source.source(m, byte)
        m.d.comb += Assume(source.valid)
        with m.If(source.transfer):
            m.d.sync += number.eq(number + 1)
            with m.If(last):
                m.d.sync += number.eq(0)

        (done,) = drive(m, unpacker, "done")
        m.d.comb += [
            framer.o.ready.eq(1),
            unpacker.data.eq(framer.o.payload),
            unpacker.valid.eq(framer.o.valid),
            unpacker.read.eq(1),
            unpacker.index.eq(0),
        ]
        # Frames that have been sent, and those that have arrived or been dropped.
        sent, arrived = Signal(3), Signal(3)
        waits, is_read = Signal(), Signal()
        new = unpacker.pending & ~waits
        m.d.sync += [
            sent.eq(sent + (source.transfer & last)),
            arrived.eq(arrived + (new | unpacker.dropped)),
            waits.eq(unpacker.pending & ~done),
            is_read.eq(unpacker.pending & ~done),
        ]
        m.d.comb += [
            Assert((arrived + new) <= sent),
            Assert(~waits | unpacker.pending),
            Assert(~unpacker.dropped | unpacker.pending),
            Assert(~unpacker.pending | (unpacker.kind == Kind.READ)),
            Assert(~(is_read & unpacker.pending) | (unpacker.word_data == word)),
            reached(m, is_read & (word[:8] == 0xC0) & (word[8:16] == 0xDB), "escaped"),
            reached(m, unpacker.dropped, "one_too_many"),
        ]


PROOFS = (
    Proof(
        name="frames.delivered",
        harness=FramesHarness,
        dut=Line,
        depth=26,
        cover=40,
        reset=False,
        short=False,
    ),
)
