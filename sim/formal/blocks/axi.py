"""Proofs of AXI: `gateware.bus.axi_stream`, `gateware.bus.axi_lite`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Assume, Cat, Module, Mux, Signal, Value

from boresight.gateware.bus.axi_lite import AxiLiteSlave, Response
from boresight.gateware.bus.axi_stream import StreamFromAxi, StreamToAxi
from boresight.sim.formal.harness import Harness, before, reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "Lite", "Packets"]


class Packets(Harness[StreamFromAxi | StreamToAxi]):
    """Any transmitter and any receiver, connected by a stream."""

    def surround(self, m: Module, dut: Any, inside: Inside) -> None:
        """Against a queue of two words: same order, none lost, none twice, none changed."""
        word = dut.word
        valid, ready = unknown(m, 1, "valid"), unknown(m, 1, "ready")
        if hasattr(dut, "o"):  # from AXI
            data, last = unknown(m, len(dut.axi.tdata), "tdata"), unknown(m, 1, "tlast")
            m.d.comb += [dut.axi.tdata.eq(data), dut.axi.tlast.eq(last)]
            m.d.comb += [dut.axi.tvalid.eq(valid), dut.o.ready.eq(ready)]
            offered, accepted = Cat(data[:word], last), dut.axi.tready
            output_valid, output = dut.o.valid, Value.cast(dut.o.payload)
            converted: Any = lambda payload: payload  # noqa: E731
        else:
            offered = unknown(m, word + 1, "payload")
            m.d.comb += [dut.i.payload.eq(offered), dut.i.valid.eq(valid), dut.axi.tready.eq(ready)]
            accepted, output_valid = dut.i.ready, dut.axi.tvalid
            output = Cat(dut.axi.tdata, dut.axi.tlast)
            sign = len(dut.axi.tdata) - word
            converted = lambda p: Cat(p[:word], p[word - 1].replicate(sign), p[word])  # noqa: E731
        head, tail = (Signal(word + 1, name=name) for name in ("head", "tail"))
        count = Signal(range(3), name="count")
        puts, gets = valid & accepted, output_valid & ready
        m.d.sync += count.eq(count + puts - gets)
        with m.If(gets):
            m.d.sync += head.eq(tail)
        with m.If(puts & (count == gets)):
            m.d.sync += head.eq(offered)
        with m.If(puts & (count == 1)):
            m.d.sync += tail.eq(offered)

        fifo = inside.parts["fifo"]
        first = fifo["consume"]
        waited = before(m, output_valid & ~ready, "waited")
        m.d.comb += [
            # Outputs follow from words accepted before this cycle: no path from any input.
            Assert(accepted == (count != 2)),
            Assert(output_valid == (count != 0)),
            Assert(~output_valid | (output == converted(head))),
            # The rules of a handshake: valid and payload stay until ready.
            Assert(~waited | (output_valid & (output == before(m, output, "given")))),
            # For induction.
            Assert(count <= 2),
            Assert(fifo.component.level == count),
            Assert(fifo["produce"] == (first + count)[0]),
            Assert((count == 0) | (fifo.word("storage", first) == head)),
            Assert((count != 2) | (fifo.word("storage", ~first) == tail)),
            reached(m, (count == 2) & gets & ~valid, "full"),
            reached(m, (count == 1) & gets & puts, "flows"),
            reached(m, waited & output_valid & ready, "late"),
        ]


class Lite(Harness[AxiLiteSlave]):
    """Any master that holds its requests, and any bus."""

    def surround(self, m: Module, dut: AxiLiteSlave, inside: Inside) -> None:
        """Each request is executed once, unchanged, and answered once."""
        axi, bus = dut.axi, dut.bus
        grant, w_ack = unknown(m, 1, "grant"), unknown(m, 1, "w_ack")
        r_data = unknown(m, len(bus.r_data), "r_data")
        m.d.comb += [
            dut.grant.eq(grant),
            bus.r_data.eq(r_data),
            bus.w_ack.eq(w_ack),
            Assume(~grant | dut.request),
            Assume(~w_ack | (grant & bus.w_stb)),
            axi.bready.eq(unknown(m, 1, "bready")),
            axi.rready.eq(unknown(m, 1, "rready")),
        ]
        wrote = self._answer(m, "b", axi.bvalid, axi.bready, axi.bresp)
        read_done = self._answer(m, "r", axi.rvalid, axi.rready, Cat(axi.rdata, axi.rresp))
        adr, has_adr = self._request(m, "aw", wrote, axi.awvalid, axi.awready, axi.awaddr)
        data, has_data = self._request(
            m, "w", wrote, axi.wvalid, axi.wready, Cat(axi.wdata, axi.wstrb)
        )
        read_address, has_read = self._request(
            m, "ar", read_done, axi.arvalid, axi.arready, axi.araddr
        )
        writes = self._writes(m, adr, data, has_adr & has_data, wrote=wrote, w_ack=w_ack)
        reads = self._reads(m, inside, read_address, has_read, done=read_done)
        m.d.comb += [
            Assert(inside["aw_full"] == has_adr),
            Assert(inside["w_full"] == has_data),
            Assert(inside["ar_full"] == has_read),
            Assert(~has_adr | (inside["aw"] == adr)),
            Assert(~has_data | (inside["w"] == data)),
            Assert(~has_read | (inside["ar"] == read_address)),
            Assert(~(dut.request & inside["fetch"])),
        ]
        self._turns(m, inside, writes, reads, wrote=wrote, read_done=read_done)

    def _answer(self, m: Module, name: str, valid: Value, ready: Value, payload: Value) -> Value:
        """A response comes in this cycle; it stays, unchanged, until it is taken."""
        waited = before(m, valid & ~ready, f"{name}_waited")
        same = payload == before(m, payload, f"{name}_before")
        m.d.comb += Assert(~waited | (valid & same))
        return valid & ~waited

    def _request(
        self, m: Module, name: str, done: Value, valid: Value, ready: Value, payload: Value
    ) -> tuple[Signal, Value]:
        """The master's last request on a channel, and whether it waits for its response."""
        offers, payloads = unknown(m, 1, f"{name}valid"), unknown(m, payload.shape(), f"{name}what")
        stored, pending = Signal(payload.shape(), name=f"{name}_kept"), Signal(name=f"{name}_given")
        waits = before(m, valid & ~ready, f"{name}_offered")
        m.d.comb += [
            valid.eq(offers),
            payload.eq(payloads),
            Assume(~waits | (offers & (payloads == before(m, payloads, f"{name}_what")))),
        ]
        is_pending = pending & ~done
        m.d.sync += pending.eq(is_pending | (valid & ready))
        with m.If(valid & ready):
            m.d.sync += stored.eq(payloads)
        # It follows from requests and responses before this cycle: no path from any input. And no
        # response without a request.
        m.d.comb += [Assert(ready == ~is_pending), Assert(~done | pending)]
        return stored, is_pending

    def _writes(
        self, m: Module, adr: Value, data: Value, full: Value, *, wrote: Value, w_ack: Value
    ) -> Value:
        """The bus executes the write unchanged; the response follows. Returns whether one waits."""
        dut, axi, bus = self.dut, self.dut.axi, self.dut.bus
        word, strobes = data[:32], data[32:]
        acknowledged = before(m, w_ack, "acknowledged")
        partial = strobes != 0b1111
        m.d.comb += [
            Assert(~bus.w_stb | (dut.request & full & ~partial & ~axi.bvalid)),
            Assert(~bus.w_stb | ((bus.addr == adr[2:]) & (bus.w_data == word[: len(bus.w_data)]))),
            Assert(~acknowledged | wrote),
            Assert(~wrote | (acknowledged == ~partial)),
            Assert(
                ~wrote | (axi.bresp == Mux(partial & strobes.any(), Response.SLVERR, Response.OKAY))
            ),
            reached(m, wrote & ~partial, "wrote"),
            reached(m, wrote & (axi.bresp == Response.SLVERR), "refused"),
            reached(m, wrote & (strobes == 0), "of_no_byte"),
        ]
        return full & ~axi.bvalid

    def _reads(
        self, m: Module, inside: Inside, address: Value, is_pending: Value, *, done: Value
    ) -> Value:
        """The bus executes the read; the response has the word of the next cycle."""
        dut, axi, bus = self.dut, self.dut.axi, self.dut.bus
        read = dut.request & ~bus.w_stb
        granted = before(m, read & dut.grant, "granted")
        word = before(m, bus.r_data, "word")
        m.d.comb += [
            Assert(~read | (is_pending & ~axi.rvalid & (bus.addr == address[2:]))),
            Assert(inside["fetch"] == granted),
            Assert(~granted | (is_pending & ~axi.rvalid)),
            Assert(done == before(m, granted, "fetched")),
            Assert(~done | (axi.rdata == word)),
            Assert(axi.rresp == Response.OKAY),
            reached(m, done, "read"),
        ]
        return is_pending & ~axi.rvalid

    def _turns(
        self,
        m: Module,
        inside: Inside,
        writes: Value,
        reads: Value,
        *,
        wrote: Value,
        read_done: Value,
    ) -> None:
        """The bus is not idle while requests wait; each kind waits for at most one of the other."""
        dut, bus = self.dut, self.dut.bus
        idle = ~dut.request & ~inside["fetch"]
        was_idle = before(m, idle & (writes | reads), "was_idle")
        m.d.comb += Assert(~was_idle | dut.request | wrote)
        passed = []
        for name, waits, other_done in (("write", writes, read_done), ("read", reads, wrote)):
            count = Signal(range(4), name=f"{name}_passed")
            with m.If(~waits):
                m.d.sync += count.eq(0)
            with m.Elif(other_done):
                m.d.sync += count.eq(count + 1)
            passed.append(Mux(waits, count + other_done, 0))
        m.d.comb += [
            Assert(passed[0] <= 1),
            Assert(passed[1] <= 1),
            Assert((passed[0] == 0) | read_done | bus.w_stb),
            Assert((passed[1] == 0) | wrote | (dut.request & ~bus.w_stb) | inside["fetch"]),
            reached(m, writes & read_done, "write_waited"),
            reached(m, reads & wrote, "read_waited"),
        ]


PROOFS = (
    Proof(
        name="axi.stream_in",
        depth=8,
        induction=2,
        cover=range(7, 9),
        claim="StreamFromAxi: the words offered on AXI come out once each, in order, unchanged, "
        "with their `last`; valid and payload stay until ready; no path from input to output",
        harness=lambda: Packets(StreamFromAxi(word=4)),
    ),
    Proof(
        name="axi.stream_out",
        depth=8,
        induction=2,
        cover=range(7, 9),
        claim="StreamToAxi: the same towards AXI, sign-extended",
        harness=lambda: Packets(StreamToAxi(word=4)),
    ),
    Proof(
        name="axi.lite",
        depth=14,
        induction=3,
        cover=range(13, 15),
        claim="AxiLiteSlave: each request is answered once, and no response comes without one; "
        "responses stay until they are taken; a write of four bytes is done on the bus once, as it "
        "was made, others never; a read has its own word; neither waits for more than one of the "
        "other; no path from input to output",
        harness=lambda: Lite(AxiLiteSlave(word=8, address=3)),
    ),
)
