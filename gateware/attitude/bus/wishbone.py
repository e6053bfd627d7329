"""Initiators of the register bus: a Wishbone slave, and the arbiter among several."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.core_registers import BusSignature


class WishboneSignature(wiring.Signature):
    """Wishbone B4, classic cycles, as its master sees it; port size and granularity 32 bits."""

    def __init__(self) -> None:
        super().__init__(
            {
                "cyc": Out(1),
                "stb": Out(1),
                "we": Out(1),
                "adr": Out(12),  # of a word
                "dat_w": Out(32),
                "dat_r": In(32),
                "ack": In(1),  # the transfer ends with this cycle
            }
        )


class WishboneSlave(wiring.Component):
    """A Wishbone slave that is an initiator of the register bus.

    Address, word and direction are stored when a transfer begins. If the master aborts it, a write
    is still finished on the bus, without an ``ack``.

    **Latency** ``ack`` comes 3 cycles after the strobe, of a read ``2 + read_cycles``, if the bus
    is free and no write waits for the core; one transfer in a cycle more. ``read_cycles`` are those
    from an address on the bus to its word.
    """

    def __init__(self, *, read_cycles: int = 1) -> None:
        self.read_cycles = read_cycles
        super().__init__(
            {
                "wb": In(WishboneSignature()),
                # An initiator of `BusArbiter`; ``grant`` is 1 for an only one.
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


class BusArbiter(wiring.Component):
    """Grants the bus to one of two initiators at a time, for one transfer, in turns.

    A transfer that has been granted is finished before another begins: a write with ``w_ack``, a
    read with the cycle of its grant (the word comes in the next one).

    **Latency** none for the last initiator, else 1 cycle.
    """

    def __init__(self) -> None:
        signature = BusSignature(word=32, address=12)
        super().__init__(
            {
                "initiators": In(signature).array(2),  # ``r_data`` goes to both of them
                # Bit k: initiator k requests the bus; held, with its other signals, until the
                # transfer's end. With ``w_stb`` it writes, else it reads.
                "request": In(2),
                "grant": Out(2),  # bit k: initiator k has the bus in this cycle
                "bus": Out(signature),
                "read": Out(1),  # in this cycle
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """An owner, which changes at the end of a transfer or without a request."""
        m = Module()
        owner = Signal()
        ended = Signal(init=1)
        for k, initiator in enumerate(self.initiators):
            m.d.comb += initiator.r_data.eq(self.bus.r_data)
            with m.If(owner == k):
                m.d.comb += [
                    self.bus.addr.eq(initiator.addr),
                    self.bus.w_data.eq(initiator.w_data),
                    self.bus.w_stb.eq(initiator.w_stb & self.request[k]),
                    self.read.eq(~initiator.w_stb & self.request[k]),
                    self.grant[k].eq(self.request[k]),
                    initiator.w_ack.eq(self.bus.w_ack & self.request[k]),
                    ended.eq(~self.request[k] | ~initiator.w_stb | self.bus.w_ack),
                ]
                with m.If(ended & self.request[1 - k]):
                    m.d.sync += owner.eq(1 - k)
        return m
