"""Wishbone to the register bus."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.signature import BusSignature


class WishboneSignature(wiring.Signature):
    """Wishbone B4, classic cycles, as its master sees it; port size and granularity 32 bits.

    Members
    -------
    cyc, stb, we : Out(1)
        Cycle, strobe, write.
    adr : Out(12)
        Word address.
    dat_w : Out(32), dat_r : In(32)
        Words.
    ack : In(1)
        The transfer ends with this cycle.
    """

    def __init__(self) -> None:
        super().__init__(
            {
                "cyc": Out(1),
                "stb": Out(1),
                "we": Out(1),
                "adr": Out(12),
                "dat_w": Out(32),
                "dat_r": In(32),
                "ack": In(1),
            }
        )


class WishboneSlave(wiring.Component):
    """A Wishbone slave that is an initiator of the register bus.

    Address, word and direction are stored when a transfer begins. If the master aborts it, a write
    is still finished on the bus, without an ``ack``.

    **Latency** ``ack`` comes 3 cycles after the strobe, of a read ``2 + read_cycles``, if the bus
    is free and no write waits for the core; one transfer in a cycle more.

    Parameters
    ----------
    read_cycles : int, >= 1
        Cycles from an address on the bus to its word.

    Members
    -------
    wb : In(WishboneSignature())
        The slave.
    bus : Out(BusSignature(word=32, address=12)), request : Out(1), grant : In(1)
        An initiator of `gateware.attitude.bus.arbiter`; ``grant`` is 1 for an only one.
    """

    def __init__(self, *, read_cycles: int = 1) -> None:
        self.read_cycles = read_cycles
        super().__init__(
            {
                "wb": In(WishboneSignature()),
                "bus": Out(BusSignature(word=32, address=12)),
                "request": Out(1),
                "grant": In(1, init=1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Idle, request, read word, acknowledge."""
        m = Module()
        wb, bus = self.wb, self.bus
        asked, writes, wanted = (Signal(name=name) for name in ("asked", "writes", "wanted"))
        fetch = Signal(self.read_cycles)  # the highest bit: the word is there
        selected = wb.cyc & wb.stb
        m.d.comb += [self.request.eq(asked), bus.w_stb.eq(asked & writes)]
        m.d.sync += [wb.ack.eq(0), fetch.eq(fetch << 1), wanted.eq(wanted & selected)]
        with m.If(~asked & ~fetch.any() & ~wb.ack):
            m.d.sync += [
                bus.addr.eq(wb.adr),
                bus.w_data.eq(wb.dat_w),
                writes.eq(wb.we),
                asked.eq(selected),
                wanted.eq(selected),
            ]
        with m.If(asked & writes & bus.w_ack):
            m.d.sync += [asked.eq(0), wb.ack.eq(wanted & selected)]
        with m.If(asked & ~writes & self.grant):
            m.d.sync += [asked.eq(0), fetch.eq(1)]
        with m.If(fetch[-1]):
            m.d.sync += [wb.dat_r.eq(bus.r_data), wb.ack.eq(wanted & selected)]
        return m
