"""Proofs of the SPI's timing rules: `gateware.attitude.sensors.spi`."""

from __future__ import annotations

from amaranth.hdl import Assert, Module, Mux, Signal, Value

from boresight.gateware.attitude.sensors.spi import BITS, SpiController
from boresight.sim.formal.harness import reached, unknown
from boresight.sim.formal.inside import InductiveHarness, Inside
from boresight.sim.formal.prove import Proof


class SpiHarness(InductiveHarness[SpiController]):
    """SPI: no shorter half period, setup or stall than requested, 16 clocks in each frame.

    There is no clock outside a frame, and both words are whole and in order. ``high_for``,
    ``since`` and ``edges`` watch ``cs_n`` and ``sclk`` alone: for how long ``cs_n`` has been high
    (up to the stall), cycles since the last edge of any of the two, edges of ``sclk`` in the frame.
    ``half`` and ``cycle`` are the position in a frame, counted from the command; the assertions
    for induction use them.
    """

    def __init__(self, dut: SpiController) -> None:
        super().__init__(dut)
        self.stall = dut.stall_halves * dut.half_cycles
        self.setup = dut.setup_cycles

    def surround(self, m: Module, dut: SpiController) -> None:
        """Rules at the pins; position in a frame; the words."""
        inside = self.inside
        valid, payload = unknown(m, 1, "valid"), unknown(m, BITS, "payload")
        m.d.comb += [
            dut.i.valid.eq(valid),
            dut.i.payload.eq(payload),
            dut.miso.eq(unknown(m, 1, "miso_pin")),
        ]
        falls = self._watch(m)
        self._frame(
            m,
            take=valid & dut.i.ready,
            payload=payload,
            miso=inside.parts["synchroniser"].component.o,
        )
        self._registers(m, inside)
        second = Signal()
        with m.If(dut.o_valid):
            m.d.sync += second.eq(1)
        m.d.comb += reached(m, second & falls, "seen")

    def _watch(self, m: Module) -> Value:
        """The rules at the pins; returns the begin of a frame."""
        dut, period = self.dut, self.dut.half_cycles
        # After a reset a frame may have been cut short, so the stall begins anew.
        cs_before = Signal(init=1)
        sclk_before = Signal(init=1)
        high_for = Signal(range(self.stall + 1))
        since = Signal(range(max(self.setup, period) + 1))
        edges = Signal(range(2 * BITS + 2))
        falls, rises = cs_before & ~dut.cs_n, ~cs_before & dut.cs_n
        changes = dut.sclk ^ sclk_before
        limit = max(self.setup, period)
        m.d.sync += [
            cs_before.eq(dut.cs_n),
            sclk_before.eq(dut.sclk),
            high_for.eq(Mux(dut.cs_n, Mux(high_for == self.stall, high_for, high_for + 1), 0)),
            since.eq(Mux(falls | changes, 1, Mux(since == limit, since, since + 1))),
            edges.eq(Mux(falls, 0, edges + changes)),
        ]
        m.d.comb += [
            Assert(~falls | (high_for == self.stall)),  # never a short stall
            Assert(~falls | (dut.sclk & sclk_before)),  # idle level at the start
            Assert(~changes | ~(dut.cs_n | cs_before)),  # edges within frames only
            Assert(~changes | (since >= Mux(edges == 0, self.setup, period))),
            Assert(~rises | ((edges == 2 * BITS) & (since >= period) & dut.sclk)),
            Assert(~dut.cs_n | dut.sclk),
        ]
        self.cs_before, self.sclk_before = cs_before, sclk_before
        self.high_for, self.since, self.edges, self.limit = high_for, since, edges, limit
        return falls

    def _frame(self, m: Module, *, take: Value, payload: Signal, miso: Signal) -> None:
        """The frame, its pins and its words."""
        dut, period = self.dut, self.dut.half_cycles
        # Position in the frame; after a reset the beginning of the stall.
        lead, frame_end = dut.setup_halves, dut.setup_halves + 2 * BITS
        total = frame_end + dut.stall_halves
        busy = Signal(init=1)
        framed = Signal()
        half = Signal(range(total + 1), init=frame_end)
        cycle = Signal(range(period))
        last = cycle == period - 1
        sent = Signal(BITS)
        heard = Signal(BITS)
        clocked = busy & (half >= lead) & (half < frame_end)
        shifts = clocked & last & ((half - lead)[0])
        with m.If(busy):
            m.d.sync += cycle.eq(Mux(last, 0, cycle + 1))
            with m.If(last):
                m.d.sync += half.eq(half + 1)
                with m.If(half == total - 1):
                    m.d.sync += [busy.eq(0), half.eq(0)]
        with m.If(shifts):
            m.d.sync += heard.eq(heard << 1 | miso)
        with m.If(take):
            m.d.sync += [busy.eq(1), half.eq(0), sent.eq(payload), heard.eq(0), framed.eq(1)]
        shifted = Signal(range(BITS + 1))
        m.d.comb += shifted.eq(Mux(clocked, (half - lead) >> 1, Mux(busy & (half < lead), 0, BITS)))
        m.d.comb += [
            Assert(dut.i.ready == ~busy),
            Assert(dut.busy == busy),
            Assert(dut.cs_n == ~(busy & (half < frame_end))),
            Assert(dut.sclk == ~(clocked & ~(half - lead)[0])),
            # Each bit of the command is stable before and during its clock.
            Assert(dut.mosi == dut.o_data[-1]),
            Assert(~clocked | (dut.mosi == sent.bit_select((BITS - 1 - shifted)[:4], 1))),
            Assert(dut.o_data == ((sent << shifted) | heard)[:BITS]),
            Assert(dut.o_valid == (busy & framed & (half == frame_end) & (cycle == 0))),
        ]
        self.busy, self.framed, self.half, self.cycle = busy, framed, half, cycle
        self.clocked, self.heard, self.shifted = clocked, heard, shifted

    def _registers(self, m: Module, inside: Inside) -> None:
        """For induction: the registers inside, and the state of the watchers."""
        dut, period = self.dut, self.dut.half_cycles
        lead, frame_end = dut.setup_halves, dut.setup_halves + 2 * BITS
        total = frame_end + dut.stall_halves
        busy, framed, half, cycle = self.busy, self.framed, self.half, self.cycle
        clocked, heard, shifted = self.clocked, self.heard, self.shifted
        cs_before, sclk_before, edges = self.cs_before, self.sclk_before, self.edges
        high_for, since, limit = self.high_for, self.since, self.limit
        left, timer = inside["left"], inside["timer"]
        base = 1 << len(left) - 1
        elapsed = (half - frame_end) * period + cycle  # of the stall
        stalls = busy & (half >= frame_end)
        ended = stalls & (half == frame_end) & (cycle == 0)
        m.d.comb += [
            Assert((high_for <= self.stall) & (since <= limit)),
            Assert((half < total) & (cycle < period) & (busy | (half + cycle == 0))),
            Assert(framed | ~busy | stalls),
            Assert((heard >> shifted) == 0),
            Assert(
                left == Mux(busy, base + 2 * BITS - 1 + lead - half, base - 1 - dut.stall_halves)
            ),
            Assert(timer == Mux(busy, period - 1 - cycle, period - 1)),
            Assert(inside["tick"] == (timer == 0)),
            Assert(
                (high_for == self.stall)
                | (stalls & (high_for == elapsed))
                | (busy & ~stalls & ((half + cycle != 0) | ~cs_before))
            ),
            Assert(~(busy & ~stalls & (half + cycle != 0)) | ~cs_before),
            Assert(~(busy & ~stalls & (half + cycle == 0)) | (cs_before & sclk_before)),
            Assert(busy | (cs_before & sclk_before)),
            Assert(~(stalls & (half + cycle != frame_end)) | (cs_before & sclk_before)),
            Assert(~ended | ((cs_before ^ framed) & sclk_before)),
            # Edges of sclk so far: that at the beginning of this half is seen within its cycle 0.
            Assert(~(busy & (half < lead) & (half + cycle != 0)) | (edges == 0)),
            Assert(~clocked | (edges == (half - lead) + (cycle != 0))),
            Assert(~(clocked & (cycle != 0)) | (sclk_before == dut.sclk)),
            Assert(~(clocked & (cycle == 0)) | (sclk_before != dut.sclk)),
            Assert(~(busy & (half < lead) & (half + cycle != 0)) | sclk_before),
            Assert(~(clocked & (cycle != 0)) | (since == cycle)),
            Assert(~(clocked & (cycle == 0) & (half > lead)) | (since >= period)),
            Assert(~(clocked & (cycle == 0) & (half == lead)) | (since >= self.setup)),
            Assert(
                ~(busy & (half < lead) & (half + cycle != 0))
                | (since == Mux(half * period + cycle > limit, limit, half * period + cycle))
            ),
            Assert(~(framed & ended) | ((edges == 2 * BITS) & (since >= period))),
        ]


PROOFS = (
    Proof(
        name="spi.framed",
        harness=SpiHarness,
        dut=lambda: SpiController(half_cycles=3, stall_cycles=3, setup_cycles=6),
        depth=2,
        induction=True,
        cover=120,
    ),
)
