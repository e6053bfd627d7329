"""A core's netlist after synthesis for Spartan-6, simulated by Verilator.

Look-up tables, carry chains, flip-flops, multipliers and block RAM take the place of the core's
Verilog; the bench is that of `sim.rtl.harness`. The cells behave as yosys' library says
(``cells_sim.v``), block RAM as `spartan6_ram.v`. What the netlist drops, the place of the
register writes, cannot be traced.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.disk.cache import Cache
from boresight.gateware.core import Core
from boresight.gateware.synthesis.yosys import cell_library, synthesise
from boresight.model.words.fixed import IntArray
from boresight.sim.rtl.harness import CompiledSimulation
from boresight.sim.rtl.wave import CORE, changes_of, wires_of

__all__ = ["NetlistSimulation", "verilog_of"]

#: Cells that only tell where something came from.
_NO_HARDWARE = "$scopeinfo"
#: Path of a net in the simulator's file.
_NET = re.compile(rf"{re.escape(CORE)}\.n\d+")
#: Memories by cell type: 256-bit parameters with the contents of data and parity.
_CONTENTS = {"RAMB16BWER": (64, 8), "RAMB8BWER": (32, 4)}
#: Parameters of a memory's output latch at configuration, which the core does not read.
_UNREAD = ("INIT_A", "INIT_B")


class NetlistSimulation(CompiledSimulation):
    """See `CompiledSimulation`; the memories' contents are in the netlist.

    Raises
    ------
    ToolMissing
        Yosys or Verilator is not installed.
    SynthesisError
        Yosys rejected the core.
    SimulationFailed
        The build failed.
    """

    def design(self, core: Core) -> tuple[dict[str, str], dict[str, str]]:
        """See `RtlSimulation.design`."""
        text = core.verilog(instances=True)
        netlist = synthesise(text, top="core", cache_dir=Cache().root).netlist
        rams = Path(__file__).with_name("spartan6_ram.v").read_text()
        sources = {
            "core.v": verilog_of(netlist, "core"),
            "cells.v": cell_library("xilinx/cells_sim.v"),
            "rams.v": rams,
        }
        return sources, {}

    def toggles(self, inputs: IntArray, first: int, stop: int) -> float:
        """Nets that change in an update, each as often: the mean over ``first`` to ``stop`` - 1.

        Values are those before each edge of the clock, so neither glitches nor the clock count.
        Built with ``trace``; ``inputs`` and errors as of `run`.
        """
        with self.record(inputs[:stop], first, stop) as path, path.open() as trace:
            _, _, codes = wires_of(trace)
            nets = {code for name, code in codes.items() if _NET.fullmatch(name)}
            cycles = changes_of(trace)
            next(cycles)  # all values, as they are
            count = sum(len(nets & changes.keys()) for _, changes in cycles)
        return count / (stop - first)


def verilog_of(netlist: Mapping[str, Any], top: str) -> str:
    """Verilog of one module of a netlist as yosys writes it to JSON: cells and wires alone."""
    module = netlist["modules"][top]
    ports, cells = module["ports"], module["cells"]
    bits = {bit for cell in cells.values() for b in cell["connections"].values() for bit in b}
    wires = sorted(bit for bit in bits if isinstance(bit, int))
    lines = [f"module {top} ({', '.join(ports)});"]
    for name, port in ports.items():
        lines.append(f"  {port['direction']} [{len(port['bits']) - 1}:0] {name};")
    lines += [f"  wire n{bit};" for bit in wires]
    for name, port in ports.items():
        nets = _nets(port["bits"])
        inward = port["direction"] == "input"
        lines.append(f"  assign {nets} = {name};" if inward else f"  assign {name} = {nets};")
    for number, cell in enumerate(cells.values()):
        if cell["type"] != _NO_HARDWARE:
            params = ", ".join(f".{k}({v})" for k, v in _parameters(cell))
            pins = ", ".join(f".{k}({_nets(v)})" for k, v in cell["connections"].items() if v)
            lines.append(f"  {cell['type']} #({params}) c{number} ({pins});")
    return "\n".join([*lines, "endmodule", ""])


def _nets(bits: Sequence[int | str]) -> str:
    nets = [f"n{b}" if isinstance(b, int) else f"1'b{b}" for b in reversed(bits)]
    return "{" + ", ".join(nets) + "}"


def _parameters(cell: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Parameters as Verilog constants; the contents of a memory as one number."""
    values = dict(cell["parameters"])
    for name in _UNREAD if cell["type"] in _CONTENTS else ():
        values.pop(name, None)
    for kind, prefix, count in zip(
        ("DATA", "PARITY"), ("INIT", "INITP"), _CONTENTS.get(cell["type"], ()), strict=False
    ):
        words = [values.pop(f"{prefix}_{k:02X}", "0" * 256) for k in range(count)]
        values[kind] = "".join(word.rjust(256, "0") for word in reversed(words))
    for name, value in values.items():
        is_bits = value and set(value) <= set("01x")
        yield name, f"{len(value)}'b{value.replace('x', '0')}" if is_bits else f'"{value.strip()}"'
