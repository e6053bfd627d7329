"""The soft core: VexRiscv of the package `pythondata-cpu-vexriscv`."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from amaranth.hdl import ClockSignal, Const, Instance, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.soc.bus import ProcessorBus
from boresight.model.errors import ToolMissing

__all__ = ["RESET_VECTOR", "Cpu", "cpu_verilog"]

#: Byte address of the first instruction.
RESET_VECTOR = 0

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
    raise ToolMissing(
        "the soft core was not found: run 'pip install pythondata-cpu-vexriscv' in "
        "this Python environment"
    )


class Cpu(wiring.Component):
    """The processor and its two buses.

    Addresses from 0x8000_0000 on bypass the caches. The bus cannot report an error to this
    processor, so every access must be acknowledged. ``wfi`` has no effect.

    Members
    -------
    restart : In(1)
        Held in reset while high.
    timer : In(1), interrupts : In(32)
        Interrupt requests, levels. CSR 0xBC0 masks ``interrupts``, CSR 0xFC0 shows them.
    ibus, dbus : Out(ProcessorBus)
        Instructions, data.
    """

    def __init__(self) -> None:
        bus = ProcessorBus()
        super().__init__(
            {
                "restart": In(1),
                "timer": In(1),
                "interrupts": In(32),
                "ibus": Out(bus),
                "dbus": Out(bus),
            }
        )

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
            i_reset=ResetSignal(allow_reset_less=True) | self.restart | starting.any(),
            i_externalResetVector=Const(RESET_VECTOR, 32),
            i_timerInterrupt=self.timer,
            i_softwareInterrupt=Const(0),
            i_externalInterruptArray=self.interrupts,
            **ports,
        )
        return m
