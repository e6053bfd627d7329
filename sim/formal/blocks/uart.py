"""Proofs of the serial line's transmitter: `gateware.boards.uart`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Cat, Const, Cover, Module, Mux, Signal

from boresight.gateware.boards.uart import Transmitter
from boresight.sim.formal.harness import Harness, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "LineFrame", "Sent"]


class LineFrame:
    """Model of the line: ``busy`` with bit ``number`` of a byte, in cycle ``phase``.

    Bit 0 is the start bit, 1 to 8 are data, 9 is the stop bit. In the last cycle of bit 9 the next
    byte may be taken. ``time`` counts the cycles since the beginning of the start bit.
    """

    def __init__(self, m: Module, *, divisor: int, take: Any, payload: Any) -> None:
        self.divisor = divisor
        self.busy = Signal(name="busy")
        self.number = Signal(range(10), name="number")
        self.phase = Signal(range(divisor), name="phase")
        self.time = Signal(range(10 * divisor), name="time")
        self.byte = Signal(8, name="byte")
        self.end = (self.phase == divisor - 1) & (self.number == 9)
        self.level = Mux(
            self.busy, Cat(Const(0, 1), self.byte, Const(1, 1)).bit_select(self.number, 1), 1
        )
        with m.If(self.busy):
            m.d.sync += [self.phase.eq(self.phase + 1), self.time.eq(self.time + 1)]
            with m.If(self.phase == divisor - 1):
                m.d.sync += [self.phase.eq(0), self.number.eq(self.number + 1)]
            with m.If(self.end):
                m.d.sync += [self.busy.eq(0), self.number.eq(0), self.time.eq(0)]
        with m.If(take):
            m.d.sync += [
                self.busy.eq(1),
                self.number.eq(0),
                self.phase.eq(0),
                self.time.eq(0),
                self.byte.eq(payload),
            ]

    def invariant(self, dut: Transmitter, inside: Inside) -> list[Any]:
        """Assertions about the transmitter's line and readiness, sufficient for induction."""
        timer, rest, busy = inside["timer"], inside["rest"], self.busy
        return [
            Assert(dut.tx == self.level),
            Assert(dut.i.ready == (~busy | self.end)),
            Assert((self.phase < self.divisor) & (self.number < 10)),
            Assert(self.time == self.number * self.divisor + self.phase),
            Assert(busy | (self.time == 0)),
            Assert(timer == Mux(busy, self.phase - (self.divisor - 1), 0)[: len(timer)]),
            Assert(inside["sample"] == ~timer.any()),
            Assert(rest == Mux(busy, Cat(self.byte, Const(1, 1)) >> self.number, 0)),
        ]


class Sent(Harness[Transmitter]):
    """The transmitter's line, cycle by cycle, and when it takes bytes.

    Parameters
    ----------
    dut : Transmitter
        Component.
    whole : bool
        Whether to reach the start bit of a second byte (else that of the first: long divisors).
    """

    def __init__(self, dut: Transmitter, *, whole: bool = True) -> None:
        super().__init__(dut)
        self.whole = whole

    def surround(self, m: Module, dut: Transmitter, inside: Inside) -> None:
        """Compare with the frame."""
        valid, payload = unknown(m, 1, "valid"), unknown(m, 8, "payload")
        m.d.comb += [dut.i.valid.eq(valid), dut.i.payload.eq(payload)]
        take = valid & dut.i.ready
        frame = LineFrame(m, divisor=dut.divisor, take=take, payload=payload)
        m.d.comb += frame.invariant(dut, inside)
        second = Signal()
        with m.If(take & frame.busy):
            m.d.sync += second.eq(1)
        m.d.comb += Cover((second if self.whole else frame.busy) & ~dut.tx)


def _proof(divisor: int) -> Proof:
    whole = divisor == 8
    return Proof(
        name=f"uart.sent_{divisor}",
        depth=8,
        induction=2,
        cover=10 * divisor + 3 if whole else 4,
        claim=f"Transmitter, {divisor} cycles per bit: the line is start bit, the byte, stop bit, "
        "each exactly so long, and high otherwise; the next byte is taken after 10 bits",
        harness=lambda: Sent(Transmitter(divisor=divisor), whole=whole),
    )


PROOFS = tuple(_proof(divisor) for divisor in (8, 9, 13, 109, 868, 5208))
