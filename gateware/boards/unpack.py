"""Received bytes to complete, checked frames."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.frames import (
    CRC,
    CRC_BYTES,
    END,
    END_ESCAPED,
    ESC,
    ESC_ESCAPED,
    Kind,
    word_bytes,
)


class Unpacker(wiring.Component):
    """Receives bytes, stores good frames of the right length, drops all others.

    The buffer has room for two frames: one that waits or is read, one that is being received. A
    frame that ends while the one before is not ``done`` is dropped. See `gateware.boards.frames`.

    **Latency** ``pending`` rises one cycle after the frame's last END; words are read with a
    latency of one cycle.

    Parameters
    ----------
    lengths : mapping of Kind to int, >= 1
        Words of a frame, for each accepted kind; kinds below 4.
    """

    def __init__(self, *, word: int, lengths: Mapping[Kind, int]) -> None:
        self.word = word
        self.lengths = dict(lengths)
        super().__init__(
            {
                # Received bytes.
                "data": In(8),
                "valid": In(1),
                "error": In(1),  # A byte without stop bit.
                "pending": Out(1),  # A frame waits, until ``done``.
                "kind": Out(2),  # Its `Kind`.
                # Index of the word to read in this cycle.
                "index": In(range(self.depth)),
                "read": In(1),
                "word_data": Out(word),  # The word, from the next cycle on.
                "done": In(1),  # The frame is no longer needed.
                "dropped": Out(1),  # A frame that was not empty has been dropped.
            }
        )

    @property
    def depth(self) -> int:
        """Words of the longest frame, rounded up to a power of two."""
        return 1 << (max(*self.lengths.values(), 2) - 1).bit_length()

    def elaborate(self, platform: Any) -> Module:
        """Remove escapes, assemble words, check at END; ``half`` of the buffer is being filled."""
        m = Module()
        size, depth = word_bytes(self.word), self.depth
        m.submodules.buffer = buffer = memory.Memory(
            shape=self.word, depth=2 * depth, init=[], attrs={"ram_style": "block"}
        )
        writer = buffer.write_port()
        reader = buffer.read_port()
        m.submodules.crc = crc = CRC.create()

        bad, escaped, headed, half = (Signal(name=n) for n in ("bad", "escaped", "headed", "half"))
        kind = Signal.like(self.data)
        place = Signal(range(size))  # of the next byte in its word
        count = Signal(range(depth + 1))  # of whole words
        gathered = Signal(8 * size)

        byte, take, end = self._bytes(m, escaped)
        m.d.comb += [
            crc.data.eq(byte),
            crc.valid.eq(take),
            crc.start.eq(end),
            writer.addr.eq(Cat(count[: (depth - 1).bit_length()], half)),
            writer.data.eq(Cat(gathered[8:], byte)),
            writer.en.eq(take & (place == size - 1)),
            reader.addr.eq(Cat(self.index, ~half)),
            reader.en.eq(self.read),
            self.word_data.eq(reader.data),
        ]

        # Any error is stored until the next END.
        behind_esc = Cat(self.data == byte for byte in (END, END_ESCAPED, ESC_ESCAPED)).any()
        with m.If(self.error | self.valid & escaped & ~behind_esc):
            m.d.sync += bad.eq(1)
        with m.If(take):
            m.d.sync += [headed.eq(1), gathered.eq(Cat(gathered[8:], byte))]
            with m.If(~headed):
                m.d.sync += kind.eq(byte)
            with m.Else():
                m.d.sync += place.eq(place + 1)
                with m.If(place == size - 1):
                    m.d.sync += [place.eq(0), count.eq(count + 1)]
                    with m.If(count == depth):
                        m.d.sync += [bad.eq(1), count.eq(depth)]

        known, expected = self._expected(m, kind, count)
        good = headed & known & ~bad & ~escaped & ~self.error & crc.match_detected
        good = good & (place == CRC_BYTES) & (count == expected) & (~self.pending | self.done)
        with m.If(self.done):
            m.d.sync += self.pending.eq(0)
        m.d.sync += self.dropped.eq(0)
        with m.If(end):
            m.d.sync += [
                *(signal.eq(0) for signal in (bad, headed, place, count)),
                self.dropped.eq(headed | bad | escaped | self.error),
            ]
            with m.If(good):
                m.d.sync += [self.pending.eq(1), self.kind.eq(kind), half.eq(~half)]
                m.d.sync += self.dropped.eq(0)
        return m

    def _bytes(self, m: Module, escaped: Signal) -> tuple[Signal, Signal, Signal]:
        """A byte without its escape, its valid bit, and the end of a frame."""
        byte = Signal.like(self.data)
        take = Signal()
        end = Signal()
        m.d.comb += [
            end.eq(self.valid & (self.data == END)),
            take.eq(self.valid & ~end & (escaped | (self.data != ESC))),
            byte.eq(self.data),
        ]
        with m.If(escaped):
            m.d.comb += byte.eq(Mux(self.data == END_ESCAPED, END, ESC))
        with m.If(self.valid):
            m.d.sync += escaped.eq(~take & ~end)
        return byte, take, end

    def _expected(self, m: Module, kind: Signal, count: Signal) -> tuple[Signal, Signal]:
        """Whether the kind is known, and its number of words before the CRC."""
        known = Signal()
        expected = Signal.like(count)
        with m.Switch(kind):
            for kind_of_frame, words in self.lengths.items():
                with m.Case(kind_of_frame):
                    m.d.comb += [known.eq(1), expected.eq(words)]
        return known, expected
