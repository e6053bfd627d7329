"""The soft core: VexRiscv of the package `pythondata-cpu-vexriscv`."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from amaranth.hdl import ClockSignal, Const, Instance, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.model.errors import ToolMissing

_PACKAGE = "pythondata_cpu_vexriscv"


def cpu_verilog() -> str:
    """Verilog text of the module ``VexRiscv``: RV32IM, caches of 4 KB, one-cycle multiplier.

    Raises
    ------
    ToolMissing
        The package is not installed.
    """
    spec = importlib.util.find_spec(_PACKAGE)
    places = [] if spec is None else list(spec.submodule_search_locations or [])
    for folder in places:
        path = Path(folder) / "verilog" / "VexRiscv.v"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise ToolMissing("the soft core was not found: pip install 'boresight[softcore]'")


#: ``cti`` of a word of a burst that is not the last: the next word follows, at the next address.
BURST = 2


class ProcessorBus(wiring.Signature):
    """Wishbone B4 with bytes and registered-feedback bursts, as the processor sees it.

    Members
    -------
    adr : Out(addr_width)
        Word address.
    dat_w : Out(32), dat_r : In(32)
        Written and read word.
    sel : Out(4)
        Bytes that are written.
    cyc, stb, we : Out(1)
        The processor's request; held until ``ack``.
    cti : Out(3)
        `BURST` if another word follows.
    ack : In(1)
        The word is taken or ``dat_r`` is there.

    Parameters
    ----------
    addr_width : int, 1 to 30
        Bits of the word address.
    """

    def __init__(self, *, addr_width: int = 30) -> None:
        super().__init__(
            {
                "adr": Out(addr_width),
                "dat_w": Out(32),
                "dat_r": In(32),
                "sel": Out(4),
                "cyc": Out(1),
                "stb": Out(1),
                "we": Out(1),
                "cti": Out(3),
                "ack": In(1),
            }
        )


class Cpu(wiring.Component):
    """The processor and its two buses.

    Execution starts at address 0. Addresses from 0x8000_0000 on bypass the caches. The bus cannot
    report an error to this processor, so every access must be acknowledged.

    Members
    -------
    ibus, dbus : Out(ProcessorBus)
        Instructions, data.
    """

    def __init__(self) -> None:
        bus = ProcessorBus()
        super().__init__({"ibus": Out(bus), "dbus": Out(bus)})

    def elaborate(self, platform: Any) -> Module:
        """Instance of the package's module, whose Verilog is a separate file."""
        m = Module()
        # On a board there is no other reset after power-up.
        starting = Signal(3, init=-1)
        m.d.sync += starting.eq(starting - starting.any())
        ports: dict[str, Any] = {}
        for name, bus in (("iBus", self.ibus), ("dBus", self.dbus)):
            ports |= {
                f"o_{name}Wishbone_{port}": getattr(bus, member)
                for port, member in (
                    ("CYC", "cyc"),
                    ("STB", "stb"),
                    ("WE", "we"),
                    ("ADR", "adr"),
                    ("DAT_MOSI", "dat_w"),
                    ("SEL", "sel"),
                    ("CTI", "cti"),
                )
            }
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
