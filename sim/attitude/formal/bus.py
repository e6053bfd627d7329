"""Proofs of the initiators of the register bus: `gateware.attitude.bus`, arbiter and Wishbone."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Assume, Cat, Module, Mux, Signal, Value

from boresight.gateware.attitude.bus.arbiter import BusArbiter
from boresight.gateware.attitude.bus.wishbone import WishboneSlave
from boresight.sim.formal.harness import before, reached, unknown
from boresight.sim.formal.inside import InductiveHarness
from boresight.sim.formal.prove import Proof


class ArbiterHarness(InductiveHarness[BusArbiter]):
    """BusArbiter: one initiator has the bus at a time, and a transfer is finished as it began.

    An acknowledge goes to its own writer; no initiator waits longer than one transfer of each
    other one. Initiators hold their requests until they are done.
    """

    def surround(self, m: Module, dut: BusArbiter) -> None:
        """One transfer at a time, each finished, every initiator served."""
        inside = self.inside
        count = dut.count
        bus, owner = dut.bus, inside["owner"]
        request = unknown(m, count, "request")
        w_ack, r_data = unknown(m, 1, "w_ack"), unknown(m, len(bus.r_data), "r_data")
        m.d.comb += [
            dut.request.eq(request),
            bus.w_ack.eq(w_ack),
            bus.r_data.eq(r_data),
            Assume(~w_ack | bus.w_stb),
        ]
        ends = [self._initiator(m, k, request=request[k]) for k in range(count)]
        writing = before(m, bus.w_stb & ~w_ack, "writing")
        m.d.comb += [
            # One at a time.
            Assert((dut.grant & (dut.grant - 1)[:count]) == 0),
            Assert((bus.w_stb | dut.read) == dut.grant.any()),
            # A write that has begun goes on until it is acknowledged.
            Assert(
                ~writing
                | (
                    bus.w_stb
                    & (bus.addr == before(m, bus.addr, "bus_addr"))
                    & (bus.w_data == before(m, bus.w_data, "bus_w_data"))
                    & (dut.grant == before(m, dut.grant, "grant_before"))
                )
            ),
            # The bus is never idle for two cycles while a request waits.
            Assert(~before(m, request.any() & ~dut.grant.any(), "idle") | dut.grant.any()),
            Assert(owner < count),
            reached(m, Cat(ends).any() & writing & w_ack, "long_write"),
            *(reached(m, end, f"end{k}") for k, end in enumerate(ends)),
        ]
        self._fair(m, owner, request, ends)

    def _initiator(self, m: Module, k: int, *, request: Value) -> Value:
        """Initiator k, which holds its request; returns the end of its transfer."""
        dut, bus, initiator = self.dut, self.dut.bus, self.dut.initiators[k]
        drives = Cat(
            unknown(m, 1, f"w_stb{k}"),
            unknown(m, len(initiator.addr), f"addr{k}"),
            unknown(m, len(initiator.w_data), f"w_data{k}"),
        )
        m.d.comb += Cat(initiator.w_stb, initiator.addr, initiator.w_data).eq(drives)
        end = request & Mux(initiator.w_stb, initiator.w_ack, dut.grant[k])
        waited = before(m, request & ~end, f"waited{k}")
        matches = (
            request
            & (bus.addr == initiator.addr)
            & (bus.w_data == initiator.w_data)
            & (bus.w_stb == initiator.w_stb)
            & (dut.read == ~initiator.w_stb)
        )
        m.d.comb += [
            Assume(~waited | (request & (drives == before(m, drives, f"drives{k}")))),
            # The bus has the signals of the granted initiator, and only its word is taken.
            Assert(~dut.grant[k] | matches),
            Assert(initiator.w_ack == (dut.grant[k] & bus.w_ack)),
            Assert(initiator.r_data == bus.r_data),
        ]
        return end

    def _fair(self, m: Module, owner: Any, request: Any, ends: list[Any]) -> None:
        """Transfers of others before one of an initiator: at most one of each."""
        count = self.dut.count
        for k in range(count):
            passed = Signal(range(count + 1), name=f"passed{k}")
            with m.If(~request[k] | ends[k]):
                m.d.sync += passed.eq(0)
            with m.Elif(Cat(ends[j] for j in range(count) if j != k).any()):
                m.d.sync += passed.eq(passed + 1)
            # Number of turns before that of k.
            distance = Mux(owner > k, count + k - owner, k - owner)
            m.d.comb += Assert(passed + distance < count)


class WishboneHarness(InductiveHarness[WishboneSlave]):
    """WishboneSlave: each transfer reaches the bus once, unchanged, and is answered once.

    A transfer that the master gives up is finished, and not answered.
    """

    def surround(self, m: Module, dut: WishboneSlave) -> None:
        """Every transfer on the bus is one that the master began, and is answered once."""
        inside = self.inside
        wb, bus = dut.wb, dut.bus
        cyc, stb = unknown(m, 1, "cyc"), unknown(m, 1, "stb")
        drives = Cat(unknown(m, 1, "we"), unknown(m, len(wb.adr), "adr"), unknown(m, 32, "dat_w"))
        grant, r_data = unknown(m, 1, "grant"), unknown(m, 32, "r_data")
        w_ack = unknown(m, 1, "w_ack")
        m.d.comb += [
            wb.cyc.eq(cyc),
            wb.stb.eq(stb),
            Cat(wb.we, wb.adr, wb.dat_w).eq(drives),
            dut.grant.eq(grant),
            bus.r_data.eq(r_data),
            bus.w_ack.eq(w_ack),
            Assume(~grant | dut.request),
            Assume(~w_ack | (grant & bus.w_stb)),
        ]
        selected = cyc & stb
        ongoing = before(m, selected & ~wb.ack, "going")
        m.d.comb += Assume(~(ongoing & selected) | (drives == before(m, drives, "drives")))

        ends = dut.request & Mux(bus.w_stb, w_ack, grant)
        fetched = before(m, ends & ~bus.w_stb, "fetched")
        idle = ~dut.request & ~fetched & ~wb.ack
        was_started = before(m, idle & selected, "began")
        transfer, active, still_selected = self._transfer(m, drives, selected, idle=idle, ends=ends)
        is_write, adr, dat_w = (
            transfer[0],
            transfer[1 : 1 + len(wb.adr)],
            transfer[1 + len(wb.adr) :],
        )
        word = before(m, r_data, "word")
        complete = before(m, Mux(is_write, ends, fetched) & still_selected & selected, "complete")
        m.d.comb += [
            # The bus has the master's transfer, unchanged, until its end, and no other.
            Assert(dut.request == active),
            Assert(
                ~dut.request | ((bus.addr == adr) & (bus.w_data == dat_w) & (bus.w_stb == is_write))
            ),
            Assert(dut.request | ~bus.w_stb),
            Assert(~was_started | dut.request),
            # The reply: once, after the end, if the master has waited for it, with the right word.
            Assert(wb.ack == complete),
            Assert(~(wb.ack & ~is_write) | (wb.dat_r == word)),
            Assert(~wb.ack | ~dut.request),
            # For induction.
            Assert(inside["fetch"] == fetched),
            Assert(~(dut.request | fetched) | (inside["wanted"] == still_selected)),
            Assert(~(fetched & (dut.request | wb.ack))),
            Assert(~fetched | ~is_write),
            reached(m, wb.ack & is_write, "wrote"),
            reached(m, wb.ack & ~is_write, "read"),
            reached(m, ends & ~still_selected, "given_up"),
        ]

    def _transfer(
        self, m: Module, drives: Value, selected: Value, *, idle: Value, ends: Value
    ) -> tuple[Signal, Signal, Signal]:
        """The transfer on the bus: the master's signals at its begin.

        Also whether it has begun and not ended, and whether the master has waited for it so far.
        """
        transfer = Signal(len(drives), name="kept")
        active, still_selected = Signal(name="begun"), Signal(name="held_on")
        with m.If(idle):
            m.d.sync += [transfer.eq(drives), active.eq(selected), still_selected.eq(selected)]
        with m.Else():
            m.d.sync += still_selected.eq(still_selected & selected)
        with m.If(ends):
            m.d.sync += active.eq(0)
        return transfer, active, still_selected


PROOFS = (
    Proof(
        name="bus.arbiter",
        harness=ArbiterHarness,
        dut=lambda: BusArbiter(count=3, word=4, address=3),
        depth=3,
        induction=True,
        cover=12,
    ),
    Proof(
        name="bus.wishbone",
        short=False,
        harness=WishboneHarness,
        dut=lambda: WishboneSlave(address=12),
        depth=3,
        induction=True,
        cover=12,
    ),
)
