"""A RISC-V soft core, to measure software beside an estimator's core, and to use that core."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from amaranth.hdl import ClockSignal, Const, Instance, Module, Mux, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.core import Core
from boresight.gateware.engine.engine import Engine
from boresight.gateware.synthesis.tools import to_verilog
from boresight.model.errors import ToolMissing

_PACKAGE = "pythondata_cpu_vexriscv"
#: ``cti`` of a word of a burst that is not the last: the next word follows, at the next address.
_BURST = 2
#: Byte address of the slot; ``firmware/attitude/soc.h`` has the same map.
_SLOT_BASE, _SLOT_BITS = 0x8000_4000, 12
#: The processor's names of the bus's members.
_PORTS = {
    **{"CYC": "cyc", "STB": "stb", "WE": "we", "ADR": "adr"},
    **{"DAT_MOSI": "dat_w", "SEL": "sel", "CTI": "cti"},
}


class ProcessorBus(wiring.Signature):
    """Wishbone B4 with bytes and registered-feedback bursts, as the processor sees it."""

    def __init__(self, *, addr_width: int = 30) -> None:
        super().__init__(
            {
                "adr": Out(addr_width),  # of a word
                "dat_w": Out(32),
                "dat_r": In(32),
                "sel": Out(4),  # bytes that are written
                "cyc": Out(1),  # with ``stb`` and ``we`` held until ``ack``
                "stb": Out(1),
                "we": Out(1),
                "cti": Out(3),  # `_BURST` if another word follows
                "ack": In(1),  # the word is taken, or ``dat_r`` is there
            }
        )


class Cpu(wiring.Component):
    """VexRiscv and its two buses, for instructions and data.

    Execution starts at address 0. Addresses from 0x8000_0000 on bypass the caches. The bus cannot
    report an error to this processor, so every access must be acknowledged.
    """

    def __init__(self) -> None:
        super().__init__({"ibus": Out(ProcessorBus()), "dbus": Out(ProcessorBus())})

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        # On a board there is no other reset after power-up.
        starting = Signal(3, init=-1)
        m.d.sync += starting.eq(starting - starting.any())
        ports: dict[str, Any] = {}
        for name, bus in (("iBus", self.ibus), ("dBus", self.dbus)):
            ports |= {f"o_{name}Wishbone_{p}": getattr(bus, own) for p, own in _PORTS.items()}
            ports |= {
                f"i_{name}Wishbone_ACK": bus.ack,
                f"i_{name}Wishbone_DAT_MISO": bus.dat_r,
                f"i_{name}Wishbone_ERR": Const(0),
            }
        m.submodules.core = Instance(
            "VexRiscv",
            i_clk=ClockSignal(),
            i_reset=ResetSignal(allow_reset_less=True) | starting.any(),
            i_externalResetVector=Const(0, 32),
            i_timerInterrupt=Const(0),
            i_softwareInterrupt=Const(0),
            i_externalInterruptArray=Const(0, 32),
            **ports,
        )
        return m


class Ram(wiring.Component):
    """Instructions and data; first those of ``firmware.hex``, 32-bit words in hexadecimal.

    **Latency** 1 cycle to ``ack``; a burst gives a word in each cycle after that. ``words`` is a
    power of two; addresses beyond it wrap.
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
            goes_on = bus.ack & (bus.cti == _BURST)
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


class CoreOnBus(wiring.Component):
    """An estimator's core at the processor's bus; ``firmware/attitude/core.h`` uses it.

    ============ ====================================================================
    word address contents
    ============ ====================================================================
    0 to 0x3FF   registers of the core
    0x400        write: next word of an input record; read: next word of an output
    0x401        write: last word of an input record
    ============ ====================================================================

    A transfer ends when the core has done it, so the processor waits for a result by reading it.
    """

    def __init__(self, *, core: Core) -> None:
        self.core = core
        super().__init__({"bus": In(ProcessorBus(addr_width=_SLOT_BITS))})

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.submodules.engine = engine = Engine(machine=self.core.machine, image=self.core.image)
        bus, registers, i, o = self.bus, engine.bus, engine.i, engine.o
        asked, of_record, fetched = (Signal(name=n) for n in ("asked", "of_record", "fetched"))
        m.d.comb += [
            asked.eq(bus.cyc & bus.stb),
            of_record.eq(bus.adr[10]),
            i.payload.data.eq(bus.dat_w),
            i.payload.last.eq(bus.adr[0]),
            registers.addr.eq(bus.adr),
            registers.w_data.eq(bus.dat_w),
            bus.dat_r.eq(registers.r_data),
        ]
        m.d.sync += fetched.eq(asked & ~fetched)
        with m.If(asked & of_record & bus.we):
            m.d.comb += [i.valid.eq(1), bus.ack.eq(i.ready)]
        with m.Elif(asked & of_record):
            m.d.comb += [o.ready.eq(1), bus.ack.eq(o.valid), bus.dat_r.eq(o.payload.data)]
        with m.Elif(asked & bus.we):
            m.d.comb += [registers.w_stb.eq(1), bus.ack.eq(registers.w_ack)]
        with m.Elif(asked):
            m.d.comb += bus.ack.eq(fetched)
        return m


class Soc(wiring.Component):
    """Processor, memory of ``words`` words, cycle counter, and a slot for a device.

    ============= =================================================================
    byte address  contents
    ============= =================================================================
    0             memory
    0x8000_0000   clock cycles since reset
    0x8000_0008   a written word appears at ``word`` for one cycle
    0x8000_4000   2048 words of the device in the slot, or 4096 without a ``core``
    0x8000_6000   2048 words of the ``core`` (`CoreOnBus`)
    ============= =================================================================
    """

    def __init__(self, *, words: int, core: Core | None = None) -> None:
        self.ram, self.core = Ram(words=words), core
        slot = ProcessorBus(addr_width=_SLOT_BITS)
        super().__init__({"slot": Out(slot), "word": Out(32), "word_valid": Out(1)})

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.submodules.cpu = cpu = Cpu()
        m.submodules.ram = ram = self.ram
        dbus, slot = cpu.dbus, self.slot
        m.d.comb += _forward(cpu.ibus, ram.ibus, cpu.ibus.cyc)
        m.d.comb += [cpu.ibus.dat_r.eq(ram.ibus.dat_r), cpu.ibus.ack.eq(ram.ibus.ack)]

        is_slot, is_own, own_ack = (Signal(name=n) for n in ("is_slot", "is_own", "own_ack"))
        asked = Signal()
        cycles, own_r = (Signal(32, name=name) for name in ("cycles", "own_r"))
        m.d.comb += [
            is_slot.eq(dbus.adr[_SLOT_BITS:] == _SLOT_BASE >> 2 + _SLOT_BITS),
            is_own.eq(dbus.adr[-1] & ~is_slot),
            asked.eq(dbus.cyc & dbus.stb & is_own & ~own_ack),
            *_forward(dbus, ram.dbus, dbus.cyc & ~dbus.adr[-1]),
            *_forward(dbus, slot, dbus.cyc & is_slot),
            dbus.ack.eq(Mux(is_slot, slot.ack, Mux(is_own, own_ack, ram.dbus.ack))),
            dbus.dat_r.eq(Mux(is_slot, slot.dat_r, Mux(is_own, own_r, ram.dbus.dat_r))),
            self.word.eq(dbus.dat_w),
            self.word_valid.eq(asked & dbus.we & (dbus.adr[:2] == 2)),
        ]
        m.d.sync += [cycles.eq(cycles + 1), own_ack.eq(asked), own_r.eq(cycles)]
        if self.core is not None:
            m.submodules.core = core = CoreOnBus(core=self.core)
            is_core = is_slot & dbus.adr[_SLOT_BITS - 1]
            m.d.comb += _forward(dbus, core.bus, dbus.cyc & is_core)
            with m.If(is_core):
                m.d.comb += [slot.cyc.eq(0), dbus.ack.eq(core.bus.ack)]
                m.d.comb += dbus.dat_r.eq(core.bus.dat_r)
        return m


def _forward(source: Any, target: Any, selected: Any) -> list[Any]:
    names = ("adr", "dat_w", "stb", "we", "sel", "cti")
    outputs = [getattr(target, name).eq(getattr(source, name)) for name in names]
    return [target.cyc.eq(selected), *outputs]


def cpu_verilog() -> str:
    """Verilog text of the module ``VexRiscv``: RV32IM, caches of 4 KB, one-cycle multiplier."""
    spec = importlib.util.find_spec(_PACKAGE)
    for folder in [] if spec is None else spec.submodule_search_locations or []:
        path = Path(folder) / "verilog" / "VexRiscv.v"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise ToolMissing("the soft core was not found: pip install 'boresight[softcore]'")


def soc_verilog(soc: Soc) -> dict[str, str]:
    """Return Verilog texts by file name: a `Soc`, its memory and processor."""
    return {
        "soc.sv": to_verilog(soc, "soc", instances=False),
        "ram.v": Path(__file__).with_name("ram.v").read_text(encoding="utf-8"),
        "VexRiscv.v": cpu_verilog(),
    }
