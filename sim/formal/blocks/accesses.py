"""Proofs of the two ends of a core on a serial line: `gateware.boards.pack`, `.dispatch`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Module, Mux, Signal

from boresight.gateware.boards.dispatch import Dispatcher
from boresight.gateware.boards.frames import Kind, word_bytes
from boresight.gateware.boards.pack import Packer
from boresight.sim.formal.harness import Harness, before, reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "WORD", "Dispatched", "Packed"]

#: Bits of a word; three bytes.
WORD = 18


def _stable_valid(m: Module, name: str, payload: Any, ready: Any) -> Any:
    """``valid`` of a stream whose source keeps valid and payload until ready."""
    valid = unknown(m, 1, f"{name}_valid")
    waited = before(m, valid & ~ready, f"{name}_waited")
    previous = before(m, payload, f"{name}_before")
    m.d.comb += Assume(~waited | (valid & (payload == previous)))
    return valid


class Packed(Harness[Packer]):
    """The bodies are those of the records and replies, byte by byte, one after the other.

    Parameters
    ----------
    dut : Packer
        Component, for words of `WORD` bits.
    """

    def surround(self, m: Module, dut: Packer, inside: Inside) -> None:
        """The current body, its next byte, and the words that are taken."""
        reply, size = dut.i_reply, word_bytes(WORD)
        ready, answer = unknown(m, 1, "ready"), unknown(m, WORD + 2, "answer")
        m.d.comb += [
            dut.o.ready.eq(ready),
            reply.payload.data.eq(answer[:WORD]),
            reply.payload.kind.eq(answer[WORD:]),
            reply.valid.eq(_stable_valid(m, "reply", answer, reply.ready)),
        ]
        recorded, final = Signal(name="of_record"), Signal(name="word_is_last")
        waits, word = Signal(name="word_waits"), Signal(WORD, name="word_taken")
        if dut.records:
            item = unknown(m, WORD + 1, "item")
            m.d.comb += [
                dut.i.payload.data.eq(item[:WORD]),
                dut.i.payload.last.eq(item[-1]),
                dut.i.valid.eq(_stable_valid(m, "record", item, dut.i.ready)),
            ]
        head, place = Signal(init=1, name="is_kind"), Signal(range(size), name="byte_number")
        out, ends = dut.o.valid & ready, Signal(name="word_ends")
        value = Signal(8 * size, name="extended")
        last = ~head & (place == size - 1) & (final | ~recorded)
        m.d.comb += [
            ends.eq(out & ~head & (place == size - 1)),
            value.eq(Mux(recorded, word.as_signed(), answer[:WORD].as_signed())),
        ]
        with m.If(out):
            m.d.sync += head.eq(last)
            with m.If(~head):
                m.d.sync += place.eq(Mux(place == size - 1, 0, place + 1))
        with m.If(ends):
            m.d.sync += waits.eq(0)
            with m.If(final):
                m.d.sync += recorded.eq(0)
        idle = head & ~recorded
        kind = Mux(recorded, Kind.RECORD, answer[WORD:])
        m.d.comb += [
            Assert(~dut.o.valid | Mux(recorded, waits, reply.valid)),
            Assert(
                ~dut.o.valid | (dut.o.payload.data == Mux(head, kind, value.word_select(place, 8)))
            ),
            Assert(~dut.o.valid | ((dut.o.payload.last == last) & ~dut.o.payload.raw)),
            Assert((reply.valid & reply.ready) == (ends & ~recorded)),
            Assert(~before(m, dut.o.valid & ~ready, "stood") | dut.o.valid),
            reached(m, ends & ~recorded, "reply"),
        ]
        count = Signal(range(4), name="idle_cycles")
        pending = reply.valid
        if dut.records:
            pending = Mux(recorded, waits, reply.valid) | dut.i.valid
            taken = dut.i.valid & dut.i.ready
            with m.If(taken):
                m.d.sync += [waits.eq(1), recorded.eq(1), word.eq(item[:WORD]), final.eq(item[-1])]
            answers, fsm = inside["answer"], inside.state
            m.d.comb += [
                # A record's words are taken when the one before has left, none in a reply's body.
                Assert(~taken | (~waits & (recorded | idle))),
                reached(m, ends & recorded & final & (word[-1]), "record"),
                # For induction.
                Assert(fsm("IDLE", "KIND", "WORD", "NEXT")),
                Assert(~fsm("IDLE") | (idle & ~waits & dut.i.ready)),
                Assert(
                    ~fsm("NEXT") | (recorded & ~waits & ~final & ~head & dut.i.ready & (place == 0))
                ),
                Assert(~fsm("KIND", "WORD") | (~dut.i.ready & (recorded == ~answers))),
                Assert(~fsm("KIND", "WORD") | Mux(answers, reply.valid, waits)),
                Assert(~fsm("NEXT") | ~answers),
                Assert(~fsm("KIND") | (head & (place == 0))),
                Assert(~fsm("WORD") | ~head),
                Assert(~fsm("KIND", "WORD") | (inside["last"] == (final | answers))),
                Assert(~fsm("KIND", "WORD") | answers | (inside["held"] == word)),
                Assert((inside["place"] == place) | fsm("IDLE")),
                Assert(~fsm("IDLE") | (place == 0)),
            ]
        else:
            m.d.comb += [
                Assert(inside["head"] == head),
                Assert(inside["place"] == place),
                Assert(~recorded & ~waits),
                Assert(head | reply.valid),
            ]
        m.d.comb += Assert((place < size) & (~head | (place == 0)))
        m.d.sync += count.eq(Mux(pending & ~dut.o.valid, count + 1, 0))
        m.d.comb += Assert(count <= 1)


class Dispatched(Harness[Dispatcher]):
    """Each frame is executed once, as it says, and answered as it shall be.

    Parameters
    ----------
    dut : Dispatcher
        Component, for words of `WORD` bits.
    """

    def surround(self, m: Module, dut: Dispatcher, inside: Inside) -> None:
        """The frame that waits; the bus; the core; the replies."""
        bus, inputs = dut.bus, dut.inputs
        state = inside.state
        # The frame, and the buffer's output, which stays without a read.
        pending, kind = unknown(m, 1, "pending"), unknown(m, 2, "kind")
        words = [Signal(WORD, name=f"word{k}") for k in range(dut.depth)]
        new = [unknown(m, WORD, f"new{k}") for k in range(dut.depth)]
        stays = before(m, pending & ~dut.done, "stays")
        kind_before, output = before(m, kind, "kind_before"), Signal(WORD, name="shown")
        m.d.sync += [w.eq(Mux(stays, w, n)) for w, n in zip(words, new, strict=True)]
        m.d.comb += [
            dut.pending.eq(pending),
            dut.kind.eq(kind),
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
        index, cycles = dut.index, dut.read_cycles
        with m.If(dut.read):
            m.d.sync += output.eq(Array(words)[index])
        # For induction: how far the frame is, and how long it has taken.
        record, first = kind == Kind.RECORD, index == 0
        at_word = Signal(WORD, name="at_word")
        m.d.comb += at_word.eq(Array(words)[index])
        reads = [f"READ_DATA{left}" for left in range(cycles)]
        access = ["ADDRESS", "READ", "WRITE", "REPLY", *reads]
        record_states = ["RECORD"] if inputs else []
        fresh = ~self.wrote & ~self.got & ~self.replied & (self.sent == 0)
        m.d.comb += [
            Assert(state("IDLE", "FETCH", "DONE", *access, *record_states)),
            Assert(state("IDLE") | pending),
            Assert(~state("IDLE") | fresh),
            Assert(~state(*access) | ~record),
            Assert(~state("ADDRESS") | (first & fresh & (output == words[0]))),
            Assert(~state("FETCH") | record | (fresh & (first | (index == 1)))),
            Assert(~(state("FETCH") & (index == 1)) | record | (kind == Kind.WRITE)),
            Assert(~state("WRITE") | ((kind == Kind.WRITE) & fresh & bus.w_stb)),
            Assert(~state("WRITE") | ((index == 1) & (output == words[1]))),
            Assert(~state("READ", *reads) | ((kind == Kind.READ) & fresh)),
            Assert(~state("REPLY") | ~self.replied),
            Assert(~state("REPLY") | Mux(kind == Kind.WRITE, self.wrote, self.got)),
            Assert(~state("DONE") | Mux(record, self.sent == inputs, self.replied)),
            Assert(bus.w_stb == state("WRITE")),
            Assert(
                ~(state(*access, "FETCH") & ~record & ~state("ADDRESS") & ~first)
                | (bus.addr == words[0][: len(bus.addr)])
            ),
            Assert(~state("READ", "WRITE", "REPLY", *reads) | (index == 1)),
            *(Assert(state(name) == (self.due == left + 1)) for left, name in enumerate(reads)),
            Assert(self.due <= cycles),
            Assert(~(state("REPLY") & (kind == Kind.READ)) | (inside["answer"] == self.answer)),
        ]
        if inputs:
            m.d.comb += [
                Assert(~(state("FETCH") & record) | ((self.sent == index) & (index < inputs))),
                Assert(~(state("FETCH") & record) | (~self.wrote & ~self.got & ~self.replied)),
                Assert(~state("RECORD") | (record & (self.sent == index) & (index < inputs))),
                Assert(~state("RECORD") | (~self.wrote & ~self.got & ~self.replied)),
                Assert(~state("RECORD") | (output == at_word)),
                Assert(dut.o.valid == state("RECORD")),
                Assert(~state("RECORD") | (dut.o.payload.last == (index == inputs - 1))),
                Assert(inside["busy"] == self.busy),
                Assert(~(state(*access, "FETCH") & ~record) | ~self.busy),
            ]
        cycle_limits: list[tuple[str, Any]] = [
            ("IDLE", 0),
            ("FETCH", Mux(record, 1 + 2 * index, Mux(first, 1, 3))),
            ("ADDRESS", 2),
            ("READ", 3),
            *((name, 3 + cycles - left) for left, name in enumerate(reads)),
            ("WRITE", 4),
            ("REPLY", Mux(kind == Kind.READ, 4 + cycles, 5)),
            ("DONE", Mux(record, 1 + 2 * inputs, Mux(kind == Kind.READ, 5 + cycles, 6))),
        ]
        if inputs:
            cycle_limits.append(("RECORD", 2 + 2 * index))
        m.d.comb += [Assert(~state(name) | (self.cycles <= count)) for name, count in cycle_limits]

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
        ack, grant, reply_ready = (
            unknown(m, 1, "ack"),
            unknown(m, 1, "grant"),
            unknown(m, 1, "reply_ready"),
        )
        m.d.comb += [
            bus.w_ack.eq(ack & bus.w_stb),
            bus.r_data.eq(unknown(m, WORD, "r_data")),
            dut.grant.eq(grant),
            reply.ready.eq(reply_ready),
        ]
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
            ready = unknown(m, 1, "core_ready")
            m.d.comb += [dut.o.ready.eq(ready), dut.answered.eq(unknown(m, 1, "answered"))]
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


def _packer(name: str, *, records: bool) -> Proof:
    return Proof(
        name=f"packer.{name}",
        depth=8,
        induction=3,
        cover=range(20, 21),
        claim=f"Packer, {name}, words of {WORD} bits: a body has its kind and the bytes of its "
        "words, in order, once, with `last`; records and replies do not mix, and a reply is "
        "taken with its last byte; the next byte waits for at most one cycle",
        harness=lambda: Packed(Packer(word=WORD, records=records)),
    )


def _dispatcher(inputs: int, cycles: int) -> Proof:
    ports = {"word": WORD, "inputs": inputs, "depth": max(inputs, 2), "address": 5}
    return Proof(
        name=f"dispatcher.{inputs}_{cycles}",
        depth=8,
        induction=3,
        cover=range(20, 21),
        claim=f"Dispatcher, {inputs} input words, {cycles} cycle(s) to read, words of {WORD} "
        "bits: each frame is executed once, as it says, and answered once with its own word; "
        "an access waits until the record before it has left; so many cycles of its own",
        harness=lambda: Dispatched(Dispatcher(**ports, read_cycles=cycles)),
    )


PROOFS = (
    _packer("records", records=True),
    _packer("replies", records=False),
    _dispatcher(3, 1),
    _dispatcher(1, 2),
    _dispatcher(0, 1),
)
