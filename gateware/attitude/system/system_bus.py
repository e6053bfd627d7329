"""Address decoder of a complete system: core, registers, results, counters on one bus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.system.csr import INDEX_BITS, Csr, EventCounters, ResultPort
from boresight.gateware.bus.core_registers import BusSignature
from boresight.gateware.registers import PROGRAM, Register

#: Bits of an address of the system's bus.
ADDRESS_BITS = 12
#: First addresses of the blocks; the core is at 0.
CSR, RESULTS, COUNTERS, FEED = 0x400, 0x500, 0x600, 0x700
#: Place of the result memory that is never written and reads 0.
_NO_RESULT = (1 << INDEX_BITS) - 1


class SystemBus(wiring.Component):
    """The registers of a complete system.

    ::

        0x000..0x204  the core, as `gateware.registers` says
        0x400..       registers of the system (`Csr`)
        0x500..0x53F  results (`Results`)
        0x600..       counters of events
        0x700..       input registers, write only, if there are some; a write waits while ``busy``

    Other addresses read 0, writes there are acknowledged and do nothing, and both are an event, as
    of the counters' own ``bad_address``. Reads of what can only be written read 0.

    **Latency** ``read_cycles`` for reading, here and of the results, with 2 through a register
    behind the memories; 1 for writing, but for the core's parameters, for which it waits.
    """

    def __init__(
        self, *, registers: Sequence[Register], events: int, feed: int = 0, read_cycles: int = 1
    ) -> None:
        self.csr = Csr(registers, read_cycles=read_cycles)
        self.read_cycles = read_cycles
        self.counters = EventCounters(count=events + 1, read_cycles=read_cycles)
        self.feed = feed
        ports = {"feed_en": Out(1), "feed_index": Out(5), "feed_data": Out(32), "feed_busy": In(1)}
        super().__init__(
            {
                "bus": In(BusSignature(word=32, address=ADDRESS_BITS)),
                "read": In(1),  # the initiator reads in this cycle; used for bad addresses only
                "core": Out(BusSignature(word=32)),
                # Their last place has to be 0; ``take`` is to be driven by the parent.
                "results": Out(ResultPort()),
                "events": In(events),  # to count; ``bad_address`` is counted after them
                "clear": In(1),  # the counters
                **self.csr.ports,
                **(ports if feed else {}),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.submodules.csr, m.submodules.counters = csr, counters = self.csr, self.counters
        bus, core, addr = self.bus, self.core, self.bus.addr
        page, low = addr[8:], addr[:8]
        is_core, is_csr, is_result, is_counter = (
            Signal(name=name) for name in ("is_core", "is_csr", "is_result", "is_counter")
        )
        index_bits = counters.index_bits - 1
        m.d.comb += [
            is_core.eq(
                ~addr[10:].any() & (~addr[9] | ~addr[3:9].any() & (addr[:3] <= PROGRAM % 8))
            ),
            is_csr.eq((page == CSR >> 8) & ~low[csr.bits :].any()),
            is_result.eq((page == RESULTS >> 8) & ~low[INDEX_BITS:].any()),
            is_counter.eq((page == COUNTERS >> 8) & ~low[index_bits:].any()),
        ]

        # A write to these blocks is done and acknowledged in its second cycle, after decoding.
        ours = Signal()
        writes_csr = Signal()
        access = Signal()
        elsewhere = Signal()
        core_answers = Signal()
        bad = Signal()
        m.d.sync += [
            ours.eq(bus.w_stb & ~is_core & ~ours),
            writes_csr.eq(bus.w_stb & is_csr & ~ours),
            core_answers.eq(is_core & addr[9]),
            access.eq(self.read | (bus.w_stb & ~ours)),
            elsewhere.eq(is_core | is_result | (is_counter & (low < counters.count))),
        ]
        m.d.comb += [
            core.addr.eq(addr),
            core.w_data.eq(bus.w_data),
            core.w_stb.eq(bus.w_stb & is_core),
            bus.w_ack.eq(bus.w_stb & (ours | core.w_ack)),
            csr.offset.eq(Cat(low[: csr.bits], ~is_csr)),
            csr.w_data.eq(bus.w_data),
            csr.w_en.eq(writes_csr),
            self.results.index.eq(Mux(is_result, low, _NO_RESULT)),
            counters.index.eq(Cat(low[:index_bits], ~is_counter)),
            counters.clear.eq(self.clear),
        ]
        of_core: Value = Mux(core_answers, core.r_data, Const(0, 32))
        events, asked = self.events, access & ~elsewhere
        if self.read_cycles == 2:
            of_core, events, asked = (_registered(m, v) for v in (of_core, events, asked))
        m.d.comb += [
            bus.r_data.eq(csr.r_data | counters.value | of_core | self.results.value),
            bad.eq(asked & ~csr.known),
            counters.events.eq(Cat(events, bad)),
        ]
        if self.feed:
            self._feed(m, ours, elsewhere)
        for name, member in csr.ports.items():
            outer, inner = getattr(self, name), getattr(csr, name)
            m.d.comb += inner.eq(outer) if member.flow is In else outer.eq(inner)
        return m

    def _feed(self, m: Module, ours: Signal, elsewhere: Signal) -> None:
        """The page of the input registers; writes are done and acknowledged unless busy."""
        bus = self.bus
        is_feed = Signal()
        ours_feed = Signal()
        low = bus.addr[:8]
        m.d.comb += is_feed.eq((bus.addr[8:] == FEED >> 8) & (low < self.feed))
        m.d.sync += ours_feed.eq(is_feed)
        with m.If(is_feed):
            m.d.sync += elsewhere.eq(1)
        m.d.comb += [
            self.feed_en.eq(ours & ours_feed & ~self.feed_busy),
            self.feed_index.eq(low),
            self.feed_data.eq(bus.w_data),
        ]
        with m.If(ours & ours_feed & self.feed_busy):
            m.d.comb += bus.w_ack.eq(0)


def _registered(m: Module, value: Value) -> Signal:
    before = Signal.like(value)
    m.d.sync += before.eq(value)
    return before
