"""Control block of the soft core: cycle counter, timer, console, watchdog, error flags."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.wishbone import WishboneSignature
from boresight.gateware.attitude.soc.layout import CONTROL, KICK
from boresight.gateware.boards.uart import Receiver, Transmitter

__all__ = ["Control"]

_ADDRESS = {register.name: k for k, register in enumerate(CONTROL)}
_STATUS = {name: k for k, name in enumerate(CONTROL[_ADDRESS["status"]].bits)}


class Control(wiring.Component):
    """Timer, console, watchdog and error flags; registers: `gateware.attitude.soc.layout.CONTROL`.

    **Latency** 1 cycle to ``ack``.

    Parameters
    ----------
    divisor : int, >= 8
        Clock cycles per bit of the console, 8N1.
    watchdog_cycles : int, >= 1024
        Cycles without a write to the watchdog after which the processor restarts, rounded up to
        a power of two.
    pages : int
        Pages of the memory.

    Members
    -------
    bus : In(WishboneSignature(address=3))
        Registers.
    rx : In(1), tx : Out(1)
        Console, asynchronous.
    bus_error, asks : In(1)
        An access failed, the device in the slot requests an interrupt, in this cycle.
    timer, device, console_full, error : Out(1)
        Interrupt requests, levels.
    fence : Out
        See `gateware.attitude.soc.memory.Ram`.
    restart : Out(1)
        Restarts the processor; 7 cycles.
    """

    def __init__(self, *, divisor: int, watchdog_cycles: int, pages: int) -> None:
        if not 1024 <= watchdog_cycles <= 1 << 32:
            raise ValueError(f"watchdog_cycles must be 1024 to 2^32, not {watchdog_cycles!r}")
        self.divisor, self.pages = divisor, pages
        self.watchdog_bits = (watchdog_cycles - 1).bit_length()
        super().__init__(
            {
                "bus": In(WishboneSignature(address=3)),
                "rx": In(1, init=1),
                "tx": Out(1, init=1),
                "bus_error": In(1),
                "asks": In(1),
                "timer": Out(1),
                "device": Out(1),
                "console_full": Out(1),
                "error": Out(1),
                "fence": Out(range(pages + 1)),
                "restart": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Registers; an event has priority over clearing its flag in the same cycle."""
        m = Module()
        bus = self.bus
        m.submodules.receiver = receiver = Receiver(divisor=self.divisor)
        m.submodules.transmitter = transmitter = Transmitter(divisor=self.divisor)
        m.d.comb += [receiver.rx.eq(self.rx), self.tx.eq(transmitter.tx)]

        asked, write = (Signal(name=name) for name in ("asked", "write"))
        m.d.comb += [asked.eq(bus.cyc & bus.stb & ~bus.ack), write.eq(asked & bus.we)]
        m.d.sync += bus.ack.eq(asked)

        written = {name: write & (bus.adr == address) for name, address in _ADDRESS.items()}

        cycles, alarm, on = self._timer(m, written)
        received = Signal.like(receiver.data)
        lost, fired = (Signal(name=name) for name in ("lost", "fired"))
        m.d.comb += [
            transmitter.i.payload.eq(bus.dat_w[:8]),
            transmitter.i.valid.eq(written["console"]),
        ]
        with m.If(asked & ~bus.we & (bus.adr == _ADDRESS["console"])):
            m.d.sync += self.console_full.eq(0)
        with m.If(written["status"]):
            for flag, name in (
                (lost, "console_lost"),
                (self.error, "bus_error"),
                (fired, "watchdog_fired"),
                (self.device, "device"),
            ):
                with m.If(bus.dat_w[_STATUS[name]]):
                    m.d.sync += flag.eq(0)
        with m.If(receiver.valid):
            m.d.sync += [received.eq(receiver.data), self.console_full.eq(1)]
        with m.If((receiver.valid & self.console_full) | receiver.error):
            m.d.sync += lost.eq(1)
        with m.If(self.bus_error):
            m.d.sync += self.error.eq(1)
        with m.If(self.asks):
            m.d.sync += self.device.eq(1)

        self._watchdog(m, written, fired)
        with m.If(self.restart):
            m.d.sync += [self.fence.eq(0), on.eq(0)]
        with m.Elif(written["fence"] & (bus.dat_w[: len(self.fence)] > self.fence)):
            m.d.sync += self.fence.eq(bus.dat_w)

        status = Cat(transmitter.i.ready, self.console_full, lost, self.error, fired, self.device)
        with m.If(asked), m.Switch(bus.adr):
            with m.Case(_ADDRESS["cycles"]):
                m.d.sync += bus.dat_r.eq(cycles)
            with m.Case(_ADDRESS["console"]):
                m.d.sync += bus.dat_r.eq(received)
            with m.Case(_ADDRESS["status"]):
                m.d.sync += bus.dat_r.eq(status)
            with m.Case(_ADDRESS["alarm"]):
                m.d.sync += bus.dat_r.eq(alarm)
            with m.Default():
                m.d.sync += bus.dat_r.eq(0)
        return m

    def _timer(self, m: Module, written: Mapping[str, Value]) -> tuple[Signal, Signal, Signal]:
        """The cycle counter, the time of the alarm, and its enable."""
        alarm = Signal.like(self.bus.dat_w)
        cycles = Signal.like(alarm)
        on = Signal()
        late = Signal.like(alarm)
        m.d.comb += late.eq(cycles - alarm)
        m.d.sync += [cycles.eq(cycles + 1), self.timer.eq(on & ~late[-1])]
        with m.If(written["alarm"]):
            m.d.sync += [alarm.eq(self.bus.dat_w), self.timer.eq(0)]
        with m.If(written["timer"]):
            m.d.sync += on.eq(self.bus.dat_w[0])
        return cycles, alarm, on

    def _watchdog(self, m: Module, written: Mapping[str, Value], fired: Signal) -> None:
        """Counts down to a restart."""
        left = Signal(self.watchdog_bits, init=-1)
        holding = Signal(3)
        m.d.comb += self.restart.eq(holding.any())
        m.d.sync += [left.eq(left - 1), holding.eq(holding - holding.any())]
        with m.If(written["watchdog"] & (self.bus.dat_w[:16] == KICK)):
            m.d.sync += left.eq(-1)
        with m.If(~left.any()):  # all ones come next
            m.d.sync += [fired.eq(1), holding.eq(-1)]
