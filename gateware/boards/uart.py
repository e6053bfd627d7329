"""Asynchronous serial line: one start bit, 8 data bits (least significant first), one stop bit."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

#: Minimum clock cycles per bit.
DIVISOR_MIN = 8
#: Largest relative error of the bit time.
TOLERANCE = 0.02


def divisor_for(*, clock_hz: float, baud: float) -> int:
    """Clock cycles per bit; ValueError if they are below `DIVISOR_MIN`, or 2 % from ``baud``."""
    divisor = round(clock_hz / baud) if baud > 0 else 0
    if divisor < DIVISOR_MIN or abs(clock_hz / divisor / baud - 1) > TOLERANCE:
        raise ValueError(
            f"baud must be at most clock_hz / {DIVISOR_MIN} and within 2 % of a whole "
            f"fraction of it, not {baud!r} at {clock_hz!r} Hz"
        )
    return divisor


class Receiver(wiring.Component):
    """Bytes from a serial line.

    The line is sampled every `spacing` cycles, 8 to 15 times in a bit. The majority of the last
    three samples counts: for the start edge, in the middle of the start bit, which must still be
    low, and in the middle of every other bit. A pulse shorter than `spacing` cycles occurs in at
    most one of three samples and has no effect. With clean edges every byte is received if the
    other side's bit time is at most 3.75 % longer or shorter at ``divisor`` 8, 4.3 % from 100 on.

    A byte without stop bit is an error; after it the line has to be high once before the next
    start bit counts, so that a line held low is one error, not many bytes.

    **Latency** ``valid`` comes `latency` cycles after the start edge, or up to `spacing` less one
    sooner: 9.5 bits, the samples, 3 cycles of synchronisation and output.

    ``spacing`` is the power of two from ``divisor`` / 16 (not included) to ``divisor`` / 8.
    """

    def __init__(self, *, divisor: int) -> None:
        self.divisor = divisor
        self.spacing: int = 1 << ((divisor // DIVISOR_MIN).bit_length() - 1)
        super().__init__(
            {
                "rx": In(1, init=1),  # The line, asynchronous to the clock; high when idle.
                "data": Out(8),  # A byte, valid in the cycle of ``valid``.
                "valid": Out(1),  # A byte is received in this cycle; there is no back-pressure.
                "error": Out(1),  # A byte had no stop bit.
                "en": In(1, init=1),  # Only cycles in which it is 1 count towards ``divisor``.
            }
        )

    @property
    def to_middle(self) -> int:
        """Cycles from the second sample of a start bit to the last of those around its middle."""
        return (self.divisor + 1 - self.spacing) // 2

    @property
    def latency(self) -> int:
        """Maximum number of cycles from the fall of ``rx`` to ``valid``."""
        return 2 + self.spacing + self.spacing - 1 + self.to_middle + 9 * self.divisor + 1

    def elaborate(self, platform: Any) -> Module:
        """One timer, counting up to 0: samples where its low bits are 0, next wait at 0."""
        m = Module()
        divisor, spacing = self.divisor, self.spacing
        rx = Signal(init=1)
        m.submodules.synchroniser = FFSynchronizer(self.rx, rx, init=1)
        timer, look = Signal(range(divisor), name="timer"), Signal(name="look")
        at_zero = Signal(init=1)  # the timer is 0
        sample = at_zero & self.en
        m.d.comb += look.eq(self.en & ~timer[: spacing.bit_length() - 1].any())

        seen, line = Signal(2, name="seen", init=3), Signal(name="line")
        m.d.comb += line.eq((rx & seen[0]) | (rx & seen[1]) | (seen[0] & seen[1]))
        with m.If(look):
            m.d.sync += seen.eq(Cat(rx, seen[0]))

        wait = Signal(range(divisor))  # until the next sample

        def after(cycles: int) -> Any:
            return wait.eq((1 - cycles) % (1 << len(timer)))

        with m.If(self.en):
            m.d.sync += [
                timer.eq(Mux(at_zero, wait, timer + 1)),
                at_zero.eq(Mux(at_zero, ~wait.any(), timer.all())),
            ]
        bits = Signal(9)  # a one above the bits that are in
        m.d.comb += self.data.eq(bits[1:])
        m.d.sync += [self.valid.eq(0), self.error.eq(0)]
        with m.FSM():
            with m.State("IDLE"):
                m.d.comb += after(spacing)
                with m.If(~line):
                    m.d.comb += after(self.to_middle)
                    with m.If(sample):
                        m.next = "START"
            with m.State("START"):
                m.d.comb += after(divisor)
                m.d.sync += bits.eq(1 << 8)
                with m.If(sample):
                    m.next = "DATA"
                with m.If(line):  # a glitch
                    m.d.comb += after(spacing)
                    with m.If(sample):
                        m.next = "IDLE"
            with m.State("DATA"):
                with m.If(~bits[0]):
                    m.d.comb += after(divisor)
                    with m.If(sample):
                        m.d.sync += bits.eq(Cat(bits[1:], line))
                with m.Else():  # the stop bit
                    m.d.comb += after(spacing)
                    with m.If(sample):
                        m.d.sync += [self.valid.eq(line), self.error.eq(~line)]
                        m.next = "BREAK"
                        with m.If(line):
                            m.next = "IDLE"
            with m.State("BREAK"):
                m.d.comb += after(spacing)
                with m.If(sample & line):
                    m.next = "IDLE"
        return m


class Transmitter(wiring.Component):
    """Bytes to a serial line.

    **Latency** one byte per 10 bits; the start bit begins one cycle after the byte is taken.
    """

    def __init__(self, *, divisor: int) -> None:
        self.divisor = divisor
        super().__init__(
            {
                "i": In(stream.Signature(8)),
                "tx": Out(1, init=1),  # The line, high when idle.
                "en": In(1, init=1),  # As of `Receiver`.
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Shift register: data and stop bit; when it is empty the byte is out."""
        m = Module()
        timer, rest = Signal(range(self.divisor), name="timer"), Signal(9, name="rest")  # up to 0
        empty, begin = Signal(name="empty"), Signal(name="begin")
        at_zero = Signal(init=1)  # the timer is 0
        sample = at_zero & self.en
        m.d.comb += [empty.eq(~rest.any()), self.i.ready.eq(empty & sample)]
        m.d.comb += begin.eq(self.i.ready & self.i.valid)
        wait = (1 - self.divisor) % (1 << len(timer))
        with m.If(sample):
            m.d.sync += self.tx.eq(Mux(empty, ~self.i.valid, rest[0]))
            m.d.sync += rest.eq(Mux(begin, Cat(self.i.payload, Const(1)), rest[1:]))
        rests = empty & ~self.i.valid
        with m.If(self.en):
            m.d.sync += [
                timer.eq(Mux(at_zero, Mux(rests, 0, wait), timer + 1)),
                at_zero.eq(Mux(at_zero, rests, timer.all())),
            ]
        return m
