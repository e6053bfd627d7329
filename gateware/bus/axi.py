"""A core with AXI: `core_axi` around the module `core`, AXI4-Stream and AXI4-Lite to its ports."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth import hdl
from amaranth.lib import wiring
from amaranth.lib.fifo import SyncFIFO
from amaranth.lib.wiring import In, Member, Out, Signature

from boresight.gateware.bus.core_registers import BusSignature
from boresight.gateware.registers import ADDRESS_BITS


class Response(IntEnum):
    """Response to a transfer."""

    OKAY = 0
    SLVERR = 2


def axi_lite(*, address: int) -> Signature:
    """AXI4-Lite (ARM IHI 0022E, part B) as its master sees it; 32 bits of data.

    ``address``: bits of a byte address. Protection bits are left out: they have no effect here.
    """
    return Signature(
        {
            # Address of a write, its word, its response.
            **{"awaddr": Out(address), "awvalid": Out(1), "awready": In(1)},
            **{"wdata": Out(32), "wstrb": Out(4), "wvalid": Out(1), "wready": In(1)},
            **{"bresp": In(2), "bvalid": In(1), "bready": Out(1)},
            # Address of a read, its response.
            **{"araddr": Out(address), "arvalid": Out(1), "arready": In(1)},
            **{"rdata": In(32), "rresp": In(2), "rvalid": In(1), "rready": Out(1)},
        }
    )


class AxiLiteSlave(wiring.Component):
    """An AXI4-Lite slave that is an initiator of the register bus.

    One write and one read are under way at a time, and neither waits for more than one of the
    other. All outputs are registered. Word k of the bus is at byte 4 k; the two low bits of an
    address are ignored. A write of fewer than four bytes has no effect and returns SLVERR, or OKAY
    for no bytes.

    **Latency** from a request that is taken to its response 3 cycles for a write, if the bus
    acknowledges at once, and 4 for a read. Bits above W of a word to write are ignored, of a word
    read 0. ``address``: bits of a word address.
    """

    def __init__(self, *, word: int = 32, address: int = 10) -> None:
        super().__init__(
            {
                "axi": In(axi_lite(address=address + 2)),  # The slave, with byte addresses.
                "bus": Out(BusSignature(word=word, address=address)),  # An initiator.
            }
        )

    def elaborate(self, platform: Any) -> hdl.Module:
        m = hdl.Module()
        axi, bus = self.axi, self.bus
        asked, writes, fetch = (hdl.Signal(name=name) for name in ("asked", "writes", "fetch"))
        aw, aw_full = _stored(m, "aw", axi.awvalid, axi.awready, axi.awaddr)
        data, w_full = _stored(m, "w", axi.wvalid, axi.wready, hdl.Cat(axi.wdata, axi.wstrb))
        ar, ar_full = _stored(m, "ar", axi.arvalid, axi.arready, axi.araddr)
        w, strobes = data[:32], data[32:]
        m.d.comb += [
            bus.addr.eq(hdl.Mux(writes, aw, ar)[2:]),
            bus.w_data.eq(w),
            bus.w_stb.eq(asked & writes),
        ]
        with m.If(axi.bready):
            m.d.sync += axi.bvalid.eq(0)
        with m.If(axi.rready):
            m.d.sync += axi.rvalid.eq(0)

        write, read, written = (hdl.Signal(name=name) for name in ("write", "read", "written"))
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
            answer = hdl.Mux(strobes.any() & ~strobes.all(), Response.SLVERR, Response.OKAY)
            m.d.sync += [axi.bvalid.eq(1), axi.bresp.eq(answer)]
        with m.If(asked & ~writes):
            m.d.sync += [asked.eq(0), fetch.eq(1)]
        with m.If(fetch):
            m.d.sync += [fetch.eq(0), ar_full.eq(0)]
            m.d.sync += [axi.rvalid.eq(1), axi.rdata.eq(bus.r_data)]
        return m


def _stored(
    m: hdl.Module, name: str, valid: hdl.Value, ready: hdl.Value, payload: hdl.Value
) -> tuple[hdl.Signal, hdl.Signal]:
    """Last payload of a channel, and whether it is still needed; until then no other is taken."""
    payload_stored, full = hdl.Signal(payload.shape(), name=name), hdl.Signal(name=f"{name}_full")
    m.d.comb += ready.eq(~full)
    with m.If(valid & ~full):
        m.d.sync += [payload_stored.eq(payload), full.eq(1)]
    return payload_stored, full


def _flat(prefix: str, signature: Signature) -> dict[str, Member]:
    """The members as separate ports; tools infer an interface from names like ``s_axis_tdata``."""
    return {f"{prefix}_{name}": member for name, member in signature.members.items()}


#: AXI4-Stream (ARM IHI 0051A) as its transmitter sees it; a packet is a record. ``tdata`` has a
#: word in the low bits, ``tlast`` marks the last word of a record.
_STREAM = Signature({"tdata": Out(32), "tlast": Out(1), "tvalid": Out(1), "tready": In(1)})
_MEMBERS = {
    **{"aclk": In(1), "aresetn": In(1)},  # The reset is synchronous, active low.
    **_flat("s_axis", _STREAM.flip()),  # Input records.
    **_flat("m_axis", _STREAM),  # Output records.
    **_flat("s_axi", axi_lite(address=ADDRESS_BITS + 2).flip()),  # Registers.
    "restart": In(1),  # This and the following are as those of the core.
    "saturated_update": Out(1),
    "beyond_update": Out(1),
}


class AxiCore(wiring.Component):
    """Records over AXI4-Stream, registers over AXI4-Lite, around the unchanged module ``core``.

    Each stream has a buffer of two words, so that all outputs are registered: AXI permits no path
    from input to output, and the core's clock enable must not depend on signals of the
    interconnect. Bits of ``s_axis_tdata`` above W are ignored, the sign fills those of
    ``m_axis_tdata``.

    **Latency** two cycles more than the core's: one for each stream; a word in each.
    """

    def __init__(self, *, word: int) -> None:
        self.word = word
        super().__init__(_MEMBERS)

    def elaborate(self, platform: Any) -> hdl.Module:
        m = hdl.Module()
        m.domains.sync = hdl.ClockDomain()
        m.d.comb += [hdl.ClockSignal().eq(self.aclk), hdl.ResetSignal().eq(~self.aresetn)]
        # Words of the core's streams, with ``last`` as the next higher bit.
        m.submodules.records_in = records_in = SyncFIFO(width=self.word + 1, depth=2)
        m.submodules.records_out = records_out = SyncFIFO(width=self.word + 1, depth=2)
        m.d.comb += [
            records_in.w_data.eq(hdl.Cat(self.s_axis_tdata[: self.word], self.s_axis_tlast)),
            records_in.w_en.eq(self.s_axis_tvalid),
            self.s_axis_tready.eq(records_in.w_rdy),
            self.m_axis_tdata.eq(records_out.r_data[: self.word].as_signed()),
            self.m_axis_tlast.eq(records_out.r_data[self.word]),
            self.m_axis_tvalid.eq(records_out.r_rdy),
            records_out.r_en.eq(self.m_axis_tready),
        ]
        m.submodules.registers = slave = AxiLiteSlave(word=self.word, address=ADDRESS_BITS)
        for name, member in axi_lite(address=ADDRESS_BITS + 2).members.items():
            port, inner = getattr(self, f"s_axi_{name}"), getattr(slave.axi, name)
            m.d.comb += inner.eq(port) if member.flow == Out else port.eq(inner)
        m.submodules.core = self.core(
            i_clk=hdl.ClockSignal(),
            i_rst=hdl.ResetSignal(),
            i_i__payload=records_in.r_data,
            i_i__valid=records_in.r_rdy,
            o_i__ready=records_in.r_en,
            o_o__payload=records_out.w_data,
            o_o__valid=records_out.w_en,
            i_o__ready=records_out.w_rdy,
            **{f"i_bus__{n}": getattr(slave.bus, n) for n in ("addr", "w_data", "w_stb")},
            **{f"o_bus__{n}": getattr(slave.bus, n) for n in ("w_ack", "r_data")},
            i_restart=self.restart,
            o_saturated_update=self.saturated_update,
            o_beyond_update=self.beyond_update,
        )
        return m

    def core(self, **ports: Any) -> hdl.Elaboratable:
        """The module ``core`` with these ports."""
        return hdl.Instance("core", **ports)


def axi_ports() -> tuple[tuple[str, str, int], ...]:
    """Direction, name and bits of every port of `AxiCore`, which is the module ``core_axi``."""
    return tuple(
        ("input" if member.flow == In else "output", name, hdl.Shape.cast(member.shape).width)
        for name, member in _MEMBERS.items()
    )
