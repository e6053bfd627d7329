"""Proof of the serial line from end to end: `gateware.boards.uart`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Assume, Cat, Const, Elaboratable, Module, Mux, Signal

from boresight.gateware.boards.uart import Receiver, Transmitter
from boresight.sim.formal.harness import Harness, Stream, reached
from boresight.sim.formal.prove import Proof


class Line(Elaboratable):
    """A transmitter, a wire and a receiver.

    Parameters
    ----------
    divisor : int
        Clock cycles per bit.
    """

    def __init__(self, divisor: int) -> None:
        self.transmitter = Transmitter(divisor=divisor)
        self.receiver = Receiver(divisor=divisor)

    def elaborate(self, platform: Any) -> Module:
        """The wire."""
        m = Module()
        m.submodules.transmitter = self.transmitter
        m.submodules.receiver = self.receiver
        m.d.comb += self.receiver.rx.eq(self.transmitter.tx)
        return m


class LineHarness(Harness[Line]):
    """Transmitter to Receiver: each bit has its time, and a byte arrives once, unchanged, in time.

    Bytes follow each other without a pause.
    """

    def surround(self, m: Module, dut: Line) -> None:
        """Model of the line: bit ``number`` of a byte, in cycle ``phase``."""
        i, tx, receiver = dut.transmitter.i, dut.transmitter.tx, dut.receiver
        divisor = receiver.divisor
        source = Stream(i.valid, i.ready, i.payload, name="i")
        source.source(m)
        m.d.comb += Assume(source.valid)  # bytes follow each other without a pause
        busy, number, phase = Signal(), Signal(range(10)), Signal(range(divisor))
        byte, previous, under_way = Signal(8), Signal(8), Signal(2)
        sent = Cat(Const(0, 1), byte, Const(1, 1))
        at_end = (phase == divisor - 1) & (number == 9)
        with m.If(busy):
            m.d.sync += phase.eq(phase + 1)
            with m.If(phase == divisor - 1):
                m.d.sync += [phase.eq(0), number.eq(Mux(at_end, 0, number + 1)), busy.eq(~at_end)]
        with m.If(source.transfer):
            m.d.sync += [busy.eq(1), byte.eq(i.payload), previous.eq(byte)]
        m.d.sync += under_way.eq(under_way + source.transfer - receiver.valid)
        # A byte arrives at the end of its stop bit, or in the start bit of the next one.
        is_next = number < 2
        m.d.comb += [
            Assert(i.ready == (~busy | at_end)),
            Assert(tx == Mux(busy, sent.bit_select(number, 1), 1)),
            Assert(~receiver.error),
            Assert(~receiver.valid | (under_way != 0)),
            Assert(~receiver.valid | (receiver.data == Mux(is_next, previous, byte))),
            Assert(under_way <= 1 + is_next),
            reached(m, receiver.valid & (byte == 0x55), "arrived"),
        ]


def _line(divisor: int, *, short: bool) -> Proof:
    return Proof(
        name=f"uart.line_{divisor}",
        harness=LineHarness,
        dut=lambda: Line(divisor),
        depth=11 * divisor,
        reset=False,
        short=short,
    )


PROOFS = (_line(8, short=True), _line(17, short=False))
