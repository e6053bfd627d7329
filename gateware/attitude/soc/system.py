"""A small computer: processor, memory, cycle counter, and a slot for a device."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.wishbone import WishboneSignature
from boresight.gateware.attitude.soc.cpu import Cpu, cpu_verilog
from boresight.gateware.attitude.soc.memory import Ram
from boresight.gateware.verilog import to_verilog

#: Byte address of the slot; ``firmware/attitude/soc.h`` has the same map.
_SLOT_BASE, _SLOT_BITS = 0x8000_4000, 12


class Soc(wiring.Component):
    """A computer that works on the words of a device.

    ============= =================================================================
    byte address  contents
    ============= =================================================================
    0             memory
    0x8000_0000   clock cycles since reset
    0x8000_0004   1 if the device has an update; a write clears it
    0x8000_0008   a written word appears at ``word`` for one cycle
    0x8000_4000   4096 words of the device in the slot
    ============= =================================================================

    Parameters
    ----------
    words : int
        Words of memory.

    Members
    -------
    slot : Out(WishboneSignature())
        The device, of whole words.
    updated : In(1)
        The device has an update in this cycle.
    word : Out(32), word_valid : Out(1)
        A word that the program gives out.
    """

    def __init__(self, *, words: int) -> None:
        self.ram = Ram(words=words)
        super().__init__(
            {
                "slot": Out(WishboneSignature()),
                "updated": In(1),
                "word": Out(32),
                "word_valid": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Instructions come from the memory; data from memory, counter or slot."""
        m = Module()
        m.submodules.cpu = cpu = Cpu()
        m.submodules.ram = ram = self.ram
        dbus, slot = cpu.dbus, self.slot
        m.d.comb += self._forward(cpu.ibus, ram.ibus, cpu.ibus.cyc)
        m.d.comb += [cpu.ibus.dat_r.eq(ram.ibus.dat_r), cpu.ibus.ack.eq(ram.ibus.ack)]

        is_slot, is_own, own_ack = (Signal(name=n) for n in ("is_slot", "is_own", "own_ack"))
        asked, waiting = (Signal(name=name) for name in ("asked", "waiting"))
        cycles, own_r = (Signal(32, name=name) for name in ("cycles", "own_r"))
        m.d.comb += [
            is_slot.eq(dbus.adr[_SLOT_BITS:] == _SLOT_BASE >> 2 + _SLOT_BITS),
            is_own.eq(dbus.adr[-1] & ~is_slot),
            asked.eq(dbus.cyc & dbus.stb & is_own & ~own_ack),
            *self._forward(dbus, ram.dbus, dbus.cyc & ~dbus.adr[-1]),
            *self._forward(dbus, slot, dbus.cyc & is_slot),
            dbus.ack.eq(Mux(is_slot, slot.ack, Mux(is_own, own_ack, ram.dbus.ack))),
            dbus.dat_r.eq(Mux(is_slot, slot.dat_r, Mux(is_own, own_r, ram.dbus.dat_r))),
            self.word.eq(dbus.dat_w),
            self.word_valid.eq(asked & dbus.we & (dbus.adr[:2] == 2)),
        ]
        m.d.sync += [
            cycles.eq(cycles + 1),
            own_ack.eq(asked),
            own_r.eq(Mux(dbus.adr[0], waiting, cycles)),
        ]
        with m.If(asked & dbus.we & (dbus.adr[:2] == 1)):
            m.d.sync += waiting.eq(0)
        with m.If(self.updated):
            m.d.sync += waiting.eq(1)
        return m

    @staticmethod
    def _forward(source: Any, target: Any, selected: Any) -> list[Any]:
        """Connect the processor's outputs to a target."""
        members = target.signature.members
        return [
            target.cyc.eq(selected),
            *(
                getattr(target, name).eq(getattr(source, name))
                for name in ("adr", "dat_w", "stb", "we", "sel", "cti")
                if name in members
            ),
        ]


def soc_verilog(top: wiring.Component, name: str) -> dict[str, str]:
    """Return Verilog texts by file name: a component with a `Soc`, its memory and processor."""
    return {
        f"{name}.sv": to_verilog(top, name, instances=False),
        "ram.v": Path(__file__).with_name("ram.v").read_text(encoding="utf-8"),
        "VexRiscv.v": cpu_verilog(),
    }
