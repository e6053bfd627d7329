"""Received bytes to complete, checked frames, and frames to the core's input stream and bus."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards import frames
from boresight.gateware.boards.uart import Receiver
from boresight.gateware.bus.core_registers import BusSignature
from boresight.gateware.engine.engine import word_layout


class Unpacker(wiring.Component):
    """Receives bytes, stores good frames of the right length, drops all others.

    The buffer has room for two frames: one that waits or is read, one that is being received. A
    frame that ends while the one before is not ``done`` is dropped. See `gateware.boards.frames`.

    **Latency** ``pending`` rises one cycle after the frame's last END; words are read with a
    latency of one cycle. ``lengths`` are the words of a frame, for each accepted kind below 4.
    """

    def __init__(self, *, word: int, lengths: Mapping[frames.Kind, int]) -> None:
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
        size, depth = frames.word_bytes(self.word), self.depth
        m.submodules.buffer = buffer = memory.Memory(
            shape=self.word, depth=2 * depth, init=[], attrs={"ram_style": "block"}
        )
        writer = buffer.write_port()
        reader = buffer.read_port()
        m.submodules.crc = crc = frames.CRC.create()

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
        behind_esc = Cat(
            self.data == byte for byte in (frames.END, frames.END_ESCAPED, frames.ESC_ESCAPED)
        ).any()
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

        known, expected = Signal(name="known"), Signal.like(count, name="expected")
        with m.Switch(kind):
            for kind_of_frame, words in self.lengths.items():
                with m.Case(kind_of_frame):
                    m.d.comb += [known.eq(1), expected.eq(words)]
        good = headed & known & ~bad & ~escaped & ~self.error & crc.match_detected
        good = (
            good & (place == frames.CRC_BYTES) & (count == expected) & (~self.pending | self.done)
        )
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
        take, end = Signal(name="take"), Signal(name="end")
        m.d.comb += [
            end.eq(self.valid & (self.data == frames.END)),
            take.eq(self.valid & ~end & (escaped | (self.data != frames.ESC))),
            byte.eq(self.data),
        ]
        with m.If(escaped):
            m.d.comb += byte.eq(Mux(self.data == frames.END_ESCAPED, frames.END, frames.ESC))
        with m.If(self.valid):
            m.d.sync += escaped.eq(~take & ~end)
        return byte, take, end


class Dispatcher(wiring.Component):
    """Executes the frames in the `Unpacker`, one at a time.

    Register accesses wait until the record before them has left, so that replies have the order of
    the frames. A record is complete before its first word goes to the core, so the core never
    waits inside an update for the serial line. All outputs to the core and its bus except
    ``reads`` are registered.

    **Latency** 2 cycles per word of a record.

    ``inputs`` are the words of an input record, 0: no records; ``depth`` those of the unpacker's
    buffer; ``address`` the bits of a register address; ``read_cycles``, 1 or more, the cycles from
    an address on the bus to its word.
    """

    def __init__(
        self, *, word: int, inputs: int, depth: int, address: int = 10, read_cycles: int = 1
    ) -> None:
        self.word = word
        self.inputs = inputs
        self.depth = depth
        self.read_cycles = read_cycles
        records = {
            "answered": In(1),  # The last word of an output record leaves the core in this cycle.
            "o": Out(stream.Signature(word_layout(word))),  # Records for the core.
        }
        super().__init__(
            {
                # To the `Unpacker`.
                "pending": In(1),
                "kind": In(2),
                "index": Out(range(depth)),
                "read": Out(1),
                "word_data": In(word),
                "done": Out(1),
                "bus": Out(BusSignature(word=word, address=address)),
                "reads": Out(1),  # The bus has the address of a word to read.
                "o_reply": Out(stream.Signature(frames.reply_layout(word))),  # To WRITE and READ.
                **(records if inputs else {}),
            }
        )

    def fed_by(self, unpacker: Unpacker, receiver: Receiver) -> list[Value]:
        """Assignments that take bytes to the unpacker, and its frames to this component."""
        return [
            *(getattr(unpacker, n).eq(getattr(receiver, n)) for n in ("data", "valid", "error")),
            *(getattr(unpacker, n).eq(getattr(self, n)) for n in ("index", "read", "done")),
            *(getattr(self, n).eq(getattr(unpacker, n)) for n in ("pending", "kind", "word_data")),
        ]

    def elaborate(self, platform: Any) -> Module:
        """One state per step of a frame."""
        m = Module()
        reply = self.o_reply
        answer = Signal(self.word)
        record, busy = Signal(name="record"), Signal(name="busy")  # requested; in the core
        m.d.comb += [
            self.bus.w_data.eq(self.word_data),
            reply.payload.data.eq(Mux(self.kind == frames.Kind.WRITE, self.bus.addr, answer)),
            reply.payload.kind.eq(self.kind),
        ]
        if self.inputs:
            m.d.comb += self.o.payload.data.eq(self.word_data)
            m.d.comb += record.eq(self.kind == frames.Kind.RECORD)
            with m.If(self.answered):
                m.d.sync += busy.eq(0)
        with m.FSM():
            with m.State("IDLE"):
                m.d.sync += self.index.eq(0)
                with m.If(self.pending & (~busy | record)):
                    m.next = "FETCH"
            with m.State("FETCH"):
                self._fetch(m, record)
            self._access(m, answer)
            with m.State("DONE"):
                m.d.comb += self.done.eq(1)
                m.next = "IDLE"
            if self.inputs:
                with m.State("RECORD"), m.If(self.o.ready):
                    m.d.sync += [self.o.valid.eq(0), self.index.eq(self.index + 1)]
                    with m.If(self.index == 0):
                        m.d.sync += busy.eq(1)
                    m.next = "FETCH"
                    with m.If(self.o.payload.last):
                        m.next = "DONE"
        return m

    def _fetch(self, m: Module, record: Value) -> None:
        m.d.comb += self.read.eq(1)
        with m.If(self.index == 0):
            m.next = "ADDRESS"
        with m.Else():
            m.d.sync += self.bus.w_stb.eq(1)
            m.next = "WRITE"
        if self.inputs:
            with m.If(record):
                m.d.sync += [
                    self.o.valid.eq(1),
                    self.bus.w_stb.eq(0),
                    self.o.payload.last.eq(self.index == self.inputs - 1),
                ]
                m.next = "RECORD"

    def _access(self, m: Module, answer: Signal) -> None:
        """States of a register access, up to its reply."""
        bus, reply = self.bus, self.o_reply
        with m.State("ADDRESS"):
            m.d.sync += [bus.addr.eq(self.word_data), self.index.eq(1)]
            m.next = "FETCH"
            with m.If(self.kind == frames.Kind.READ):
                m.next = "READ"
        with m.State("READ"):
            m.d.comb += self.reads.eq(1)
            m.next = f"READ_DATA{self.read_cycles - 1}"
        for left in range(1, self.read_cycles):
            with m.State(f"READ_DATA{left}"):
                m.next = f"READ_DATA{left - 1}"
        with m.State("READ_DATA0"):
            m.d.sync += answer.eq(bus.r_data)
            m.next = "REPLY"
        with m.State("WRITE"), m.If(bus.w_ack):
            m.d.sync += bus.w_stb.eq(0)
            m.next = "REPLY"
        with m.State("REPLY"):
            m.d.comb += reply.valid.eq(1)
            with m.If(reply.ready):
                m.next = "DONE"
