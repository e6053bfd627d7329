"""Proofs of the two ends of a core on a serial line: `gateware.boards.pack`, `.dispatch`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from amaranth.hdl import Array, Assert, Assume, Cat, Const, Module, Mux, Signal, Value

from boresight.gateware.boards.dispatch import Dispatcher
from boresight.gateware.boards.frames import Kind, word_bytes
from boresight.gateware.boards.pack import Packer
from boresight.sim.formal.harness import (
    Harness,
    Stream,
    StreamHarness,
    before,
    drive,
    fixed,
    reached,
    unknown,
)
from boresight.sim.formal.prove import Proof

#: Bits of a word; three bytes.
WORD = 18


class RecordHarness(StreamHarness[Packer]):
    """Packer: a record becomes its kind and the bytes of its words, in order, once."""

    def ends(self, dut: Packer) -> tuple[Stream, Stream]:
        """Records and bodies."""
        i, o = dut.i, dut.o
        source = Stream(i.valid, i.ready, i.payload.data, i.payload.last, name="i")
        return source, Stream(o.valid, o.ready, o.payload.data, o.payload.last, name="o")

    def script(self, m: Module) -> tuple[Sequence[Value], Sequence[Value]]:
        """A record of two words, and one of one word."""
        words = [fixed(m, WORD, f"word{k}") for k in range(3)]
        lasts = (0, 1, 1)
        outputs = []
        for k, (word, last) in enumerate(zip(words, lasts, strict=True)):
            if k == 0 or lasts[k - 1]:
                outputs.append(Const(Kind.RECORD, 9))
            outputs += _bytes(word, last)
        return [Cat(word, Const(last, 1)) for word, last in zip(words, lasts, strict=True)], outputs


class ReplyHarness(StreamHarness[Packer]):
    """Packer: a reply becomes its kind and the bytes of its word, in order, once, with ``last``."""

    def ends(self, dut: Packer) -> tuple[Stream, Stream]:
        """Replies and bodies."""
        i, o = dut.i_reply, dut.o
        source = Stream(i.valid, i.ready, i.payload.data, i.payload.kind, name="i_reply")
        return source, Stream(o.valid, o.ready, o.payload.data, o.payload.last, name="o")

    def script(self, m: Module) -> tuple[Sequence[Value], Sequence[Value]]:
        """Two replies."""
        replies = [fixed(m, WORD + 2, f"reply{k}") for k in range(2)]
        outputs = []
        for reply in replies:
            outputs += [Cat(reply[WORD:], Const(0, 7)), *_bytes(reply[:WORD], 1)]
        return replies, outputs


def _bytes(word: Value, last: int) -> list[Value]:
    """Bytes of a sign-extended word, the final one with ``last``."""
    size = word_bytes(WORD)
    extended = Cat(word, word[-1].replicate(8 * size - WORD))
    return [Cat(extended[8 * k : 8 * k + 8], Const(last and k == size - 1, 1)) for k in range(size)]


class DispatcherHarness(Harness[Dispatcher]):
    """Dispatcher: each frame is executed once, as it says, and answered as it shall be.

    Parameters
    ----------
    dut : Dispatcher
        Component, for words of `WORD` bits.
    """

    def surround(self, m: Module, dut: Dispatcher) -> None:
        """The frame that waits; the bus; the core; the replies."""
        inputs = dut.inputs
        # The frame, and the buffer's output, which stays without a read.
        pending, kind = drive(m, dut, "pending", "kind")
        words = [Signal(WORD, name=f"word{k}") for k in range(dut.depth)]
        new = [unknown(m, WORD, f"new{k}") for k in range(dut.depth)]
        stays = before(m, pending & ~dut.done, "stays")
        kind_before, output = before(m, kind, "kind_before"), Signal(WORD, name="shown")
        m.d.sync += [w.eq(Mux(stays, w, n)) for w, n in zip(words, new, strict=True)]
        m.d.comb += [
            dut.word_data.eq(output),
            Assume(~stays | (pending & (kind == kind_before))),
            Assume(
                ~pending
                | (kind == Kind.WRITE)
                | (kind == Kind.READ)
                | ((kind == Kind.RECORD) & bool(inputs))
            ),
        ]
        self._claims(m, pending, kind, words)
        with m.If(dut.read):
            m.d.sync += output.eq(Array(words)[dut.index])

    def _claims(self, m: Module, pending: Any, kind: Any, words: list[Signal]) -> None:
        """Effects of the frame so far, and those that it may have now."""
        dut, bus, reply, inputs = self.dut, self.dut.bus, self.dut.o_reply, self.dut.inputs
        wrote, got, replied = (Signal(name=n) for n in ("wrote", "got", "replied"))
        self.wrote, self.got, self.replied = wrote, got, replied
        self.answer = answer = Signal(WORD, name="answer_read")
        sent, busy = Signal(range(inputs + 1), name="sent"), Signal(name="in_core")
        self.sent, self.busy = sent, busy
        self.due = due = Signal(range(dut.read_cycles + 2), name="read_due")
        self.cycles = cycles = Signal(8, name="own_cycles")
        m.d.comb += bus.w_ack.eq(unknown(m, 1, "ack") & bus.w_stb)
        (grant,), (reply_ready,) = drive(m, dut, "grant"), drive(m, reply, "ready")
        drive(m, bus, "r_data")
        address = words[0][: len(bus.addr)]
        read_request = dut.request & ~bus.w_stb
        stalled = (bus.w_stb & ~bus.w_ack) | (reply.valid & ~reply_ready) | (read_request & ~grant)
        with m.If(bus.w_ack):
            m.d.sync += wrote.eq(1)
        m.d.sync += due.eq(Mux(read_request & grant, dut.read_cycles, Mux(due == 0, 0, due - 1)))
        with m.If(due == 1):
            m.d.sync += [got.eq(1), answer.eq(bus.r_data)]
        with m.If(reply.valid & reply_ready):
            m.d.sync += replied.eq(1)
        if inputs:
            (ready,) = drive(m, dut.o, "ready")
            drive(m, dut, "answered")
            transfer = dut.o.valid & ready
            with m.If(dut.answered):
                m.d.sync += busy.eq(0)
            with m.If(transfer):
                m.d.sync += sent.eq(sent + 1)
                with m.If(sent == 0):
                    m.d.sync += busy.eq(1)
            stalled = stalled | (dut.o.valid & ~ready) | (busy & (kind != Kind.RECORD))
            m.d.comb += [
                Assert(~dut.o.valid | (pending & (kind == Kind.RECORD) & (sent < inputs))),
                Assert(~dut.o.valid | (dut.o.payload.data == Array(words)[sent])),
                Assert(~dut.o.valid | (dut.o.payload.last == (sent == inputs - 1))),
                Assert(~before(m, dut.o.valid & ~ready, "offered") | dut.o.valid),
                Assert(~dut.request | ~busy),
                reached(m, dut.done & (kind == Kind.RECORD), "record"),
            ]
        m.d.sync += cycles.eq(cycles + (pending & ~stalled))
        with m.If(dut.done):
            m.d.sync += [s.eq(0) for s in (wrote, got, replied, sent, cycles)]
        is_read, is_write = kind == Kind.READ, kind == Kind.WRITE
        m.d.comb += [
            Assert(~bus.w_stb | (pending & is_write & ~wrote & dut.request)),
            Assert(~bus.w_stb | ((bus.addr == address) & (bus.w_data == words[1]))),
            Assert(~before(m, bus.w_stb & ~bus.w_ack, "written") | bus.w_stb),
            Assert(~read_request | (pending & is_read & ~got & (due == 0) & (bus.addr == address))),
            Assert((due == 0) | (bus.addr == address)),
            Assert(~reply.valid | (pending & ~replied & Mux(is_read, got, is_write & wrote))),
            Assert(~reply.valid | (reply.payload.kind == kind)),
            Assert(~reply.valid | (reply.payload.data == Mux(is_read, answer, address))),
            Assert(~before(m, reply.valid & ~reply_ready, "answering") | reply.valid),
            Assert(~dut.done | (pending & Mux(is_read | is_write, replied, sent == inputs))),
            Assert(cycles <= max(6 + dut.read_cycles, 7, 2 + 2 * inputs)),
            reached(m, dut.done & is_read, "read"),
            reached(m, dut.done & is_write, "write"),
        ]


def _dispatcher(inputs: int, cycles: int, *, short: bool) -> Proof:
    depth = max(2, 1 << (inputs - 1).bit_length()) if inputs else 2
    return Proof(
        name=f"dispatcher.{inputs}_{cycles}",
        harness=DispatcherHarness,
        dut=lambda: Dispatcher(word=WORD, inputs=inputs, depth=depth, read_cycles=cycles),
        depth=18,
        short=short,
    )


PROOFS = (
    Proof(name="packer.records", harness=RecordHarness, dut=lambda: Packer(word=WORD), depth=16),
    Proof(
        name="packer.replies",
        harness=ReplyHarness,
        dut=lambda: Packer(word=WORD, records=False),
        depth=12,
        short=False,
    ),
    _dispatcher(0, 1, short=False),
    _dispatcher(3, 2, short=True),
)
