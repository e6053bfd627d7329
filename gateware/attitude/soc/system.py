"""The soft core with memory, control block and a slot for a device on its bus."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.wishbone import WishboneSignature
from boresight.gateware.attitude.soc.control import Control
from boresight.gateware.attitude.soc.cpu import Cpu, cpu_verilog
from boresight.gateware.attitude.soc.layout import CONTROL, CONTROL_BASE, SLOT_BASE, SLOT_WORDS
from boresight.gateware.attitude.soc.memory import Ram, ram_verilog
from boresight.gateware.verilog import to_verilog

__all__ = ["Soc", "soc_verilog"]

_SLOT_BITS = (SLOT_WORDS - 1).bit_length()


class Soc(wiring.Component):
    """A computer; addresses: `gateware.attitude.soc.layout`.

    An access without a device is acknowledged, reads 0, and sets the status bit ``bus_error``; so
    is one to a device that has not acknowledged after `patience` cycles. So the bus never stops
    the processor.

    Parameters
    ----------
    words : int
        Words of memory, see `Ram`.
    divisor : int
        Clock cycles per bit of the console.
    watchdog_cycles : int
        See `Control`.
    image : str
        File with the firmware, 32-bit words in hexadecimal, read by simulator or synthesis.

    Attributes
    ----------
    patience : int
        Maximum cycles of a device in the slot.

    Members
    -------
    rx : In(1), tx : Out(1)
        Console.
    slot : Out(WishboneSignature(address=12))
        A device, of whole words.
    interrupt : In(1)
        Interrupt of the device, in this cycle; stored in the status register until cleared.
    restart : Out(1)
        The watchdog restarts the processor; a device may abort its work.
    """

    patience = 4096

    def __init__(
        self,
        *,
        words: int,
        divisor: int,
        watchdog_cycles: int = 1 << 24,
        image: str = "firmware.hex",
    ) -> None:
        self.ram = Ram(words=words, image=image)
        self.control = Control(
            divisor=divisor, watchdog_cycles=watchdog_cycles, pages=self.ram.pages
        )
        super().__init__(
            {
                "rx": In(1, init=1),
                "tx": Out(1, init=1),
                "slot": Out(WishboneSignature(address=_SLOT_BITS)),
                "interrupt": In(1),
                "restart": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Processor, memory, control block."""
        m = Module()
        m.submodules.cpu = cpu = Cpu()
        m.submodules.ram = ram = self.ram
        m.submodules.control = control = self.control
        m.d.comb += [
            control.rx.eq(self.rx),
            self.tx.eq(control.tx),
            cpu.restart.eq(control.restart),
            self.restart.eq(control.restart),
            cpu.timer.eq(control.timer),
            cpu.interrupts.eq(Cat(control.device, control.console_full, control.error)),
            control.asks.eq(self.interrupt),
            ram.fence.eq(control.fence),
        ]
        # Instructions come from memory only.
        outside = Signal()
        m.d.comb += [
            outside.eq(cpu.ibus.adr[-1]),
            *self._forward(cpu.ibus, ram.ibus, cpu.ibus.cyc),
            cpu.ibus.dat_r.eq(Mux(outside, 0, ram.ibus.dat_r)),
            cpu.ibus.ack.eq(ram.ibus.ack),
        ]
        gives_up = self._data(m, cpu.dbus)
        m.d.comb += control.bus_error.eq(ram.refused | (cpu.ibus.ack & outside) | gives_up)
        return m

    def _data(self, m: Module, dbus: Any) -> Signal:
        """Address decoder: memory, control, slot, unmapped; 1 when an access is aborted."""
        ram, control, slot = self.ram, self.control, self.slot

        def at(base: int, words: int) -> Any:
            bits = (words - 1).bit_length()
            return dbus.adr[bits:] == base >> 2 + bits

        is_ram, is_control, is_slot = (
            Signal(name=name) for name in ("is_ram", "is_control", "is_slot")
        )
        m.d.comb += [
            is_ram.eq(~dbus.adr[-1]),
            is_control.eq(at(CONTROL_BASE, 8)),
            is_slot.eq(at(SLOT_BASE, SLOT_WORDS)),
            *self._forward(dbus, ram.dbus, dbus.cyc & is_ram),
            *self._forward(dbus, control.bus, dbus.cyc & is_control),
            *self._forward(dbus, slot, dbus.cyc & is_slot),
        ]
        # Devices that do not acknowledge in time, and unmapped addresses.
        waited = Signal(range(self.patience + 1))
        gives_up = Signal()
        unmapped = ~(is_ram | is_control | is_slot)
        m.d.sync += [
            waited.eq(Mux(dbus.cyc & dbus.stb & ~dbus.ack, waited + 1, 0)),
            gives_up.eq(
                dbus.cyc & dbus.stb & ~dbus.ack & (unmapped | (waited == self.patience - 1))
            ),
        ]
        m.d.comb += [
            dbus.ack.eq(
                (ram.dbus.ack & is_ram)
                | (control.bus.ack & is_control)
                | (slot.ack & is_slot)
                | gives_up
            ),
            dbus.dat_r.eq(
                Mux(
                    gives_up,
                    0,
                    Mux(
                        is_ram,
                        ram.dbus.dat_r,
                        Mux(is_slot, slot.dat_r, Mux(is_control, control.bus.dat_r, 0)),
                    ),
                )
            ),
        ]
        return gives_up

    @staticmethod
    def _forward(source: Any, target: Any, asks: Any) -> list[Any]:
        """Connect the processor's outputs to a target that is selected while ``asks``."""
        members = target.signature.members
        return [
            target.cyc.eq(asks),
            *(
                getattr(target, name).eq(getattr(source, name))
                for name in ("adr", "dat_w", "stb", "we", "sel", "cti")
                if name in members
            ),
        ]


def soc_verilog(soc: Soc, *, instances: bool = False) -> dict[str, str]:
    """Verilog texts by file name: top module ``soc``, memory, processor."""
    assert len(CONTROL) <= 8
    return {
        "soc.v": to_verilog(soc, "soc", instances=instances),
        "ram.v": ram_verilog(),
        "VexRiscv.v": cpu_verilog(),
    }
