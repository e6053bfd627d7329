"""AXI4-Lite to the register bus."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.signature import BusSignature


class Response(IntEnum):
    """Response to a transfer."""

    OKAY = 0
    SLVERR = 2


class AxiLiteSignature(wiring.Signature):
    """AXI4-Lite (ARM IHI 0022E, part B) as its master sees it; 32 bits of data.

    The protection bits are left out, since they have no effect here.

    Parameters
    ----------
    address : int
        Bits of a byte address, A.
    """

    def __init__(self, *, address: int) -> None:
        super().__init__(
            {
                # Address of a write.
                "awaddr": Out(address),
                "awvalid": Out(1),
                "awready": In(1),
                # Word of a write.
                "wdata": Out(32),
                "wstrb": Out(4),
                "wvalid": Out(1),
                "wready": In(1),
                # Its response.
                "bresp": In(2),
                "bvalid": In(1),
                "bready": Out(1),
                # Address of a read.
                "araddr": Out(address),
                "arvalid": Out(1),
                "arready": In(1),
                # Its response.
                "rdata": In(32),
                "rresp": In(2),
                "rvalid": In(1),
                "rready": Out(1),
            }
        )


class AxiLiteSlave(wiring.Component):
    """An AXI4-Lite slave that is an initiator of the register bus.

    One write and one read are under way at a time, and neither waits for more than one of the
    other. All outputs are registered. Word k of the bus is at byte 4 k; the two low bits of an
    address are ignored. A write of fewer than four bytes has no effect and returns SLVERR, or OKAY
    for no bytes.

    **Latency** from a request that is taken to its response 3 cycles for a write, if the bus
    acknowledges at once, and 4 for a read.

    Parameters
    ----------
    word : int
        W, 32 or fewer; upper bits of a word to write are ignored, of a word read 0.
    address : int
        Bits of a word address, A.
    """

    def __init__(self, *, word: int = 32, address: int = 10) -> None:
        super().__init__(
            {
                "axi": In(AxiLiteSignature(address=address + 2)),  # The slave, with byte addresses.
                # An initiator of `gateware.attitude.bus.wishbone`; ``grant`` is 1 for an only one.
                "bus": Out(BusSignature(word=word, address=address)),
                "request": Out(1),
                "grant": In(1, init=1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Store requests, execute them on the bus, respond."""
        m = Module()
        axi, bus = self.axi, self.bus
        asked, writes, fetch = (Signal(name=name) for name in ("asked", "writes", "fetch"))
        aw, aw_full = _stored(m, "aw", axi.awvalid, axi.awready, axi.awaddr)
        data, w_full = _stored(m, "w", axi.wvalid, axi.wready, Cat(axi.wdata, axi.wstrb))
        ar, ar_full = _stored(m, "ar", axi.arvalid, axi.arready, axi.araddr)
        w, strobes = data[:32], data[32:]
        m.d.comb += [
            self.request.eq(asked),
            bus.addr.eq(Mux(writes, aw, ar)[2:]),
            bus.w_data.eq(w),
            bus.w_stb.eq(asked & writes),
        ]
        with m.If(axi.bready):
            m.d.sync += axi.bvalid.eq(0)
        with m.If(axi.rready):
            m.d.sync += axi.rvalid.eq(0)

        write = Signal()
        read = Signal()
        written = Signal()
        m.d.comb += [
            write.eq(aw_full & w_full & ~axi.bvalid),
            read.eq(ar_full & ~axi.rvalid),
            written.eq(asked & writes & bus.w_ack),
        ]
        with m.If(~asked & ~fetch):
            # A read does not wait forever: after a write the next one needs a cycle.
            with m.If(write):
                m.d.sync += [asked.eq(1), writes.eq(1)]
                m.d.comb += written.eq(~strobes.all())
            with m.Else():
                m.d.sync += [asked.eq(read), writes.eq(0)]
        with m.If(written):
            m.d.sync += [asked.eq(0), aw_full.eq(0), w_full.eq(0)]
            answer = Mux(strobes.any() & ~strobes.all(), Response.SLVERR, Response.OKAY)
            m.d.sync += [axi.bvalid.eq(1), axi.bresp.eq(answer)]
        with m.If(asked & ~writes & self.grant):
            m.d.sync += [asked.eq(0), fetch.eq(1)]
        with m.If(fetch):
            m.d.sync += [fetch.eq(0), ar_full.eq(0)]
            m.d.sync += [axi.rvalid.eq(1), axi.rdata.eq(bus.r_data)]
        return m


def _stored(
    m: Module, name: str, valid: Value, ready: Value, payload: Value
) -> tuple[Signal, Signal]:
    """Last payload of a channel, and whether it is still needed; until then no other is taken."""
    payload_stored, full = Signal(payload.shape(), name=name), Signal(name=f"{name}_full")
    m.d.comb += ready.eq(~full)
    with m.If(valid & ~full):
        m.d.sync += [payload_stored.eq(payload), full.eq(1)]
    return payload_stored, full
