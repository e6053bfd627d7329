"""Frames to the core: records to its input stream, register accesses to its bus."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.frames import Kind
from boresight.gateware.boards.pack import reply_layout
from boresight.gateware.boards.uart import Receiver
from boresight.gateware.boards.unpack import Unpacker
from boresight.gateware.bus.core_registers import BusSignature
from boresight.gateware.engine.engine import word_layout


class Dispatcher(wiring.Component):
    """Executes the frames in the `Unpacker`, one at a time.

    Register accesses wait until the record before them has left, so that replies have the order of
    the frames. A record is complete before its first word goes to the core, so the core never
    waits inside an update for the serial line. All outputs to the core and its bus except
    ``request`` are registered.

    **Latency** 2 cycles per word of a record.

    Parameters
    ----------
    inputs : int, >= 0
        Words of an input record; 0: no records.
    depth : int
        Words of the unpacker's buffer.
    address : int
        Bits of a register address, A.
    read_cycles : int, >= 1
        Cycles from an address on the bus to its word.
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
                # The bus is needed; the target sees it in this cycle. A read word comes in the
                # cycle after the first one with a grant, a write is acknowledged only with one. 1
                # for an only initiator.
                "request": Out(1),
                "grant": In(1, init=1),
                "o_reply": Out(stream.Signature(reply_layout(word))),  # To WRITE and READ.
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
        record = Signal()  # requested
        busy = Signal()  # in the core
        m.d.comb += [
            self.bus.w_data.eq(self.word_data),
            reply.payload.data.eq(Mux(self.kind == Kind.WRITE, self.bus.addr, answer)),
            reply.payload.kind.eq(self.kind),
            self.request.eq(self.bus.w_stb),
        ]
        if self.inputs:
            m.d.comb += [
                self.o.payload.data.eq(self.word_data),
                record.eq(self.kind == Kind.RECORD),
            ]
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
        """Read a word of the frame."""
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
            with m.If(self.kind == Kind.READ):
                m.next = "READ"
        with m.State("READ"):  # the bus has the address
            m.d.comb += self.request.eq(1)
            with m.If(self.grant):
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
