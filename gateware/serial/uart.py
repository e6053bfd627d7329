"""Asynchronous serial line: one start bit, 8 data bits (least significant first), one stop bit."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

__all__ = ["DIVISOR_MIN", "Receiver", "Transmitter", "divisor_for"]

#: Fewest clock cycles per bit.
DIVISOR_MIN = 8
#: Largest relative error of the bit time.
TOLERANCE = 0.02


def divisor_for(*, clock_hz: float, baud: float) -> int:
    """Clock cycles per bit.

    Raises
    ------
    ValueError
        Not positive, fewer than `DIVISOR_MIN` cycles per bit, or more than 2 % beside ``baud``.
    """
    for name, value in (("clock_hz", clock_hz), ("baud", baud)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
            raise ValueError(f"{name} must be a positive number, not {value!r}")
    divisor = round(clock_hz / baud)
    if divisor < DIVISOR_MIN or abs(clock_hz / divisor / baud - 1) > TOLERANCE:
        raise ValueError(f"baud must be at most clock_hz / {DIVISOR_MIN} and within 2 % of a whole "
                         f"fraction of it, not {baud!r} at {clock_hz!r} Hz")
    return divisor


def _check_divisor(divisor: int) -> None:
    if not isinstance(divisor, int) or divisor < DIVISOR_MIN:
        raise ValueError(f"divisor must be an integer from {DIVISOR_MIN} on, not {divisor!r}")


class Receiver(wiring.Component):
    """Bytes from a serial line.

    A byte without stop bit is an error; after it the line has to be high once before the next
    start bit counts, so that a line held low is one error, not many bytes.

    **Latency** ``o_valid`` comes 2 cycles of synchronisation and 9.5 bits after the start edge.

    Parameters
    ----------
    divisor : int, >= 8
        Clock cycles per bit.

    Members
    -------
    rx : In(1)
        The line, asynchronous to the clock; high when idle.
    data : Out(8)
        A byte, valid in the cycle of ``valid``.
    valid : Out(1)
        A byte is there in this cycle. It cannot be made to wait.
    error : Out(1)
        A byte had no stop bit.
    """

    def __init__(self, *, divisor: int) -> None:
        _check_divisor(divisor)
        self.divisor = divisor
        super().__init__({"rx": In(1, init=1), "data": Out(8), "valid": Out(1), "error": Out(1)})

    def elaborate(self, platform: Any) -> Module:
        """Sample each bit in its middle."""
        m = Module()
        rx = Signal(init=1)
        m.submodules.synchroniser = FFSynchronizer(self.rx, rx, init=1)
        timer = Signal(range(self.divisor))
        bits = Signal(range(9))
        sample = Signal()
        m.d.comb += sample.eq(timer == 0)
        m.d.sync += timer.eq(timer - 1)
        with m.If(sample):
            m.d.sync += timer.eq(self.divisor - 1)
        m.d.sync += [self.valid.eq(0), self.error.eq(0)]

        with m.FSM():
            with m.State("IDLE"):
                m.d.sync += [timer.eq(self.divisor // 2 - 1), bits.eq(0)]
                with m.If(~rx):
                    m.next = "START"
            with m.State("START"), m.If(sample):
                with m.If(rx):  # a glitch
                    m.next = "IDLE"
                with m.Else():
                    m.next = "DATA"
            with m.State("DATA"), m.If(sample):
                m.d.sync += [self.data.eq(Cat(self.data[1:], rx)), bits.eq(bits + 1)]
                with m.If(bits == 7):
                    m.next = "STOP"
            with m.State("STOP"), m.If(sample):
                m.d.sync += [self.valid.eq(rx), self.error.eq(~rx)]
                with m.If(rx):
                    m.next = "IDLE"
                with m.Else():
                    m.next = "BREAK"
            with m.State("BREAK"), m.If(rx):
                m.next = "IDLE"
        return m


class Transmitter(wiring.Component):
    """Bytes to a serial line.

    **Latency** one byte per 10 bits and a cycle; the start bit begins one cycle after the byte
    is taken.

    Parameters
    ----------
    divisor : int, >= 8
        Clock cycles per bit.

    Members
    -------
    i : In(stream of 8)
        Bytes.
    tx : Out(1)
        The line, high when idle.
    """

    def __init__(self, *, divisor: int) -> None:
        _check_divisor(divisor)
        self.divisor = divisor
        super().__init__({"i": In(stream.Signature(8)), "tx": Out(1, init=1)})

    def elaborate(self, platform: Any) -> Module:
        """Shift register: data and stop bit."""
        m = Module()
        timer = Signal(range(self.divisor))
        rest = Signal(9)
        left = Signal(range(11))
        m.d.comb += self.i.ready.eq(left == 0)
        with m.If(left == 0):
            m.d.sync += timer.eq(self.divisor - 1)
            with m.If(self.i.valid):
                m.d.sync += [self.tx.eq(0), rest.eq(Cat(self.i.payload, Const(1, 1))), left.eq(10)]
        with m.Elif(timer == 0):
            m.d.sync += [timer.eq(self.divisor - 1), left.eq(left - 1),
                         self.tx.eq(rest[0]), rest.eq(Cat(rest[1:], Const(1, 1)))]
        with m.Else():
            m.d.sync += timer.eq(timer - 1)
        return m
