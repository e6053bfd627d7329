"""Memory of the soft core: block RAM, read by both buses at the same time."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import ClockSignal, Instance, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from boresight.gateware.attitude.soc.cpu import BURST, ProcessorBus


class Ram(wiring.Component):
    """Instructions and data; first those of ``firmware.hex``, 32-bit words in hexadecimal.

    **Latency** 1 cycle to ``ack``; a burst gives a word in each cycle after that. Addresses beyond
    the memory wrap.

    Parameters
    ----------
    words : int
        Size, a power of two.

    Members
    -------
    ibus, dbus : In(ProcessorBus(addr_width=29))
        Buses.
    """

    def __init__(self, *, words: int) -> None:
        self.words = words
        bus = ProcessorBus(addr_width=29)
        super().__init__({"ibus": In(bus), "dbus": In(bus)})

    def elaborate(self, platform: Any) -> Module:
        """Acknowledge a cycle later; in a burst read the next word meanwhile."""
        m = Module()
        width = (self.words - 1).bit_length()
        answer, address = {}, {}
        for name, bus in (("i", self.ibus), ("d", self.dbus)):
            answer[name] = Signal(32, name=f"{name}_answer")
            address[name] = Signal(width, name=f"{name}_address")
            goes_on = bus.ack & (bus.cti == BURST)
            m.d.comb += [address[name].eq(bus.adr + goes_on), bus.dat_r.eq(answer[name])]
            m.d.sync += bus.ack.eq(bus.cyc & bus.stb & (~bus.ack | goes_on))
        write = self.dbus.cyc & self.dbus.stb & self.dbus.we & self.dbus.ack
        m.submodules.memory = Instance(
            "boresight_ram",
            p_WORDS=self.words,
            p_WIDTH=width,
            p_IMAGE="firmware.hex",
            i_clk=ClockSignal(),
            i_a_addr=address["i"],
            o_a_data=answer["i"],
            i_b_addr=address["d"],
            i_b_we=Mux(write, self.dbus.sel, 0),
            i_b_w_data=self.dbus.dat_w,
            o_b_data=answer["d"],
        )
        return m
