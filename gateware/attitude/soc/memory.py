"""Memory of the soft core: block RAM, read by both buses at the same time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from amaranth.hdl import ClockSignal, Instance, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.soc.bus import BURST, ProcessorBus

__all__ = ["PAGE_WORDS", "Ram", "ram_verilog"]

#: Words of a page, the unit of write protection: 1 KB.
PAGE_WORDS = 256


def ram_verilog() -> str:
    """Verilog text of the module ``boresight_ram``."""
    return Path(__file__).with_name("ram.v").read_text(encoding="utf-8")


class Ram(wiring.Component):
    """Instructions and data.

    **Latency** 1 cycle to ``ack``; a burst gives a word in each cycle after that. Addresses beyond
    the memory read as 0 (no instruction is 0) and are not written.

    Parameters
    ----------
    words : int, a multiple of `PAGE_WORDS`, at most 2^16
        Size.
    image : str
        Name of the file with the first contents, 32-bit words in hexadecimal.

    Members
    -------
    ibus, dbus : In(ProcessorBus(addr_width=29))
        Buses.
    fence : In
        Pages below this number are not written.
    refused : Out(1)
        An access was beyond the memory or a write below the fence, in this cycle.
    """

    def __init__(self, *, words: int, image: str = "firmware.hex") -> None:
        if not PAGE_WORDS <= words <= 1 << 16 or words % PAGE_WORDS:
            raise ValueError(f"words must be a multiple of {PAGE_WORDS} up to 65536, not {words!r}")
        self.words, self.image = words, image
        self.pages = words // PAGE_WORDS
        bus = ProcessorBus(addr_width=29)
        super().__init__(
            {
                "ibus": In(bus),
                "dbus": In(bus),
                "fence": In(range(self.pages + 1)),
                "refused": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Acknowledge a cycle later; in a burst read the next word meanwhile."""
        m = Module()
        width = (self.words - 1).bit_length()
        answer, address, inside_memory = {}, {}, {}
        for name, bus in (("i", self.ibus), ("d", self.dbus)):
            answer[name] = Signal(32, name=f"{name}_answer")
            address[name] = Signal(width, name=f"{name}_address")
            inside_memory[name] = Signal(name=f"{name}_known")
            inside = Signal(name=f"{name}_inside")
            goes_on = bus.ack & (bus.cti == BURST)
            m.d.comb += [
                inside.eq(bus.adr < self.words),
                address[name].eq(bus.adr + goes_on),
                bus.dat_r.eq(Mux(inside_memory[name], answer[name], 0)),
            ]
            m.d.sync += [
                bus.ack.eq(bus.cyc & bus.stb & (~bus.ack | goes_on)),
                inside_memory[name].eq(inside),
            ]
        write = self.dbus.cyc & self.dbus.stb & self.dbus.we & self.dbus.ack
        page = self.dbus.adr[(PAGE_WORDS - 1).bit_length() :]
        allowed = Signal()
        m.d.comb += allowed.eq((self.dbus.adr < self.words) & (page >= self.fence))
        m.d.comb += self.refused.eq(
            (write & ~allowed)
            | (self.dbus.ack & ~self.dbus.we & ~inside_memory["d"])
            | (self.ibus.ack & ~inside_memory["i"])
        )
        m.submodules.memory = Instance(
            "boresight_ram",
            p_WORDS=self.words,
            p_WIDTH=width,
            p_IMAGE=self.image,
            i_clk=ClockSignal(),
            i_a_addr=address["i"],
            o_a_data=answer["i"],
            i_b_addr=address["d"],
            i_b_we=Mux(write & allowed, self.dbus.sel, 0),
            i_b_w_data=self.dbus.dat_w,
            o_b_data=answer["d"],
        )
        return m
