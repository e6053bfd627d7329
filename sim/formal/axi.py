"""Proof of the registers over AXI4-Lite: `gateware.bus.axi`."""

from __future__ import annotations

from amaranth.hdl import Assert, Assume, Module, Mux, Signal, Value

from boresight.gateware.bus.axi import AxiLiteSlave, Response
from boresight.sim.formal.harness import Harness, Proof, Stream, before, drive, reached


class AxiLiteHarness(Harness):
    """AxiLiteSlave: each request is executed once, unchanged, and answered once.

    A write of four bytes reaches the bus, others do not. A read has the word of its address.
    Neither kind waits for more than one of the other, nor for more than five cycles in which the
    bus does not wait. A channel's ``ready`` follows from earlier cycles: no path leads from input
    to output.
    """

    def surround(self, m: Module, dut: AxiLiteSlave) -> None:
        axi, bus = dut.axi, dut.bus
        w_ack, r_data = drive(m, bus, "w_ack", "r_data")
        m.d.comb += Assume(~w_ack | bus.w_stb)
        b = Stream(axi.bvalid, axi.bready, axi.bresp, name="b")
        r = Stream(axi.rvalid, axi.rready, axi.rdata, axi.rresp, name="r")
        for answer in (b, r):
            answer.sink(m)
        # An answer is new in this cycle.
        wrote, read_done = (
            s.valid & ~before(m, s.valid & ~s.ready, f"{s.name}_new") for s in (b, r)
        )
        aw, has_aw = self._request(
            m, Stream(axi.awvalid, axi.awready, axi.awaddr, name="aw"), wrote
        )
        w, has_w = self._request(
            m, Stream(axi.wvalid, axi.wready, axi.wdata, axi.wstrb, name="w"), wrote
        )
        ar, has_ar = self._request(
            m, Stream(axi.arvalid, axi.arready, axi.araddr, name="ar"), read_done
        )
        word, strobes = w[:32], w[32:]
        acknowledged = before(m, w_ack, "acknowledged")
        partial = strobes != 0b1111
        refused = partial & strobes.any()
        asked = has_ar & ~axi.rvalid & ~bus.w_stb & (bus.addr == ar[2:])
        fetched = before(m, before(m, asked, "asked"), "fetched")
        m.d.comb += [
            Assert(~bus.w_stb | (has_aw & has_w & ~partial & ~axi.bvalid)),
            Assert(~bus.w_stb | ((bus.addr == aw[2:]) & (bus.w_data == word[: len(bus.w_data)]))),
            Assert(~acknowledged | wrote),
            Assert(~wrote | (acknowledged == ~partial)),
            Assert(~wrote | (axi.bresp == Mux(refused, Response.SLVERR, Response.OKAY))),
            Assert(~read_done | (fetched & (axi.rdata == before(m, r_data, "read_word")))),
            Assert(axi.rresp == Response.OKAY),
            reached(m, wrote & ~partial, "wrote"),
            reached(m, wrote & refused, "refused"),
            reached(m, wrote & (strobes == 0), "no_byte"),
            reached(m, read_done, "read"),
        ]
        waiting = {"write": has_aw & has_w & ~axi.bvalid, "read": has_ar & ~axi.rvalid}
        for (name, waits), other in zip(waiting.items(), (read_done, wrote), strict=True):
            passed, cycles = Signal(2, name=f"{name}_passed"), Signal(4, name=f"{name}_cycles")
            m.d.sync += [
                passed.eq(Mux(waits, passed + other, 0)),
                cycles.eq(Mux(waits, cycles + (~bus.w_stb | w_ack), 0)),
            ]
            m.d.comb += [
                Assert(~waits | (passed + other <= 1)),
                Assert(cycles <= 5),
                reached(m, waits & other, f"{name}_waited"),
            ]

    def _request(self, m: Module, channel: Stream, done: Value) -> tuple[Signal, Value]:
        """The master's last request on a channel, and whether it waits for its answer."""
        channel.source(m)
        stored, pending = Signal.like(channel.payload, name=channel.name), Signal()
        waits = pending & ~done
        m.d.sync += pending.eq(waits | channel.transfer)
        with m.If(channel.transfer):
            m.d.sync += stored.eq(channel.payload)
        m.d.comb += [Assert(channel.ready == ~waits), Assert(~done | pending)]
        return stored, waits


PROOFS = (
    Proof(
        name="axi.lite",
        depth=24,
        harness=AxiLiteHarness,
        dut=lambda: AxiLiteSlave(word=8, address=3),
    ),
)
