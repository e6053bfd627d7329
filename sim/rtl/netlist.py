"""A core's netlist after synthesis for a family, simulated by Verilator.

Look-up tables, carry chains, flip-flops, multipliers and block RAM take the place of the core's
Verilog; the bench is that of `sim.rtl.harness`. The cells behave as yosys' library says, and where
that says nothing as ``spartan6_cells.v``, ``ecp5_cells.v``, ``nexus_cells.v`` and
``gowin_cells.v`` do. What the netlist drops, the place of the register writes, cannot be traced.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from boresight.gateware.core import Core
from boresight.gateware.synthesis.routed import netlist_of
from boresight.gateware.synthesis.spartan6.family import SPARTAN6
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.yosys import cell_library
from boresight.sim.rtl.harness import CompiledSimulation

#: Cells that only tell where something came from.
_NO_HARDWARE = "$scopeinfo"
#: Module of a file in Verilog.
_LINES = re.MULTILINE | re.DOTALL
_MODULE = re.compile(r"^module (\w+)", _LINES)
#: Parameters of a memory's output latch at configuration, which the core does not read.
_UNUSED = ("INIT_A", "INIT_B")


@dataclass(frozen=True, kw_only=True)
class Cells:
    """How the cells of a family are simulated.

    Attributes
    ----------
    library : tuple of str
        Files of yosys' library.
    included : tuple of str
        Files of yosys' library that these include.
    files : tuple of str
        Files beside this one.
    contents : mapping
        Memories by type of cell: parameters that hold all words, and for each the start of the
        names of those side by side that it stands for, their number, and bits of each.
    vectors : set of str
        Types of cells whose pins with numbers are vectors in ``files``.
    """

    library: tuple[str, ...]
    included: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    contents: Mapping[str, Mapping[str, tuple[str, int, int]]] = field(default_factory=dict)
    vectors: frozenset[str] = frozenset()

    def sources(self) -> dict[str, str]:
        """Their Verilog, by file name; a cell of ``files`` replaces that of the library."""
        texts = {name: Path(__file__).with_name(name).read_text() for name in self.files}
        kinds = "|".join(kind for text in texts.values() for kind in _MODULE.findall(text))
        library = "".join(["`define NO_INCLUDES\n", *map(cell_library, self.library)])
        if kinds:
            library = re.sub(rf"^module (?:{kinds})\b.*?^endmodule", "", library, flags=_LINES)
        included = {Path(name).name: cell_library(name) for name in self.included}
        return {"cells.v": library, **included, **texts}


#: By the family's name.
CELLS: Final[Mapping[str, Cells]] = {
    "spartan6": Cells(
        library=("xilinx/cells_sim.v",),
        files=("block_ram.v", "spartan6_cells.v"),
        contents={
            "RAMB16BWER": {"DATA": ("INIT_", 64, 256), "PARITY": ("INITP_", 8, 256)},
            "RAMB8BWER": {"DATA": ("INIT_", 32, 256), "PARITY": ("INITP_", 4, 256)},
        },
    ),
    "ecp5": Cells(
        library=("ecp5/common_sim.vh", "ecp5/ccu2c_sim.vh"),
        files=("block_ram.v", "nine_bit_ram.v", "ecp5_cells.v"),
        contents={"DP16KD": {"CONTENTS": ("INITVAL_", 64, 320)}},
        vectors=frozenset({"DP16KD", "MULT18X18D"}),
    ),
    "ice40": Cells(library=("ice40/cells_sim.v",)),
    "nexus": Cells(
        library=("lattice/cells_sim_nexus.v",),
        included=("lattice/parse_init.vh",),
        files=("block_ram.v", "nine_bit_ram.v", "nexus_cells.v"),
        contents={kind: {"CONTENTS": ("INITVAL_", 64, 320)} for kind in ("PDP16K", "PDPSC16K")},
    ),
    "gw2a": Cells(
        library=("gowin/cells_sim.v",),
        files=("block_ram.v", "nine_bit_ram.v", "gowin_cells.v"),
        contents={
            kind: {"CONTENTS": ("INIT_RAM_", 64, 288)} for kind in ("SPX9", "SDPX9B", "DPX9B")
        },
    ),
}

#: Parts whose cells are simulated.
SIMULATED: Final = tuple(name for name, part in TARGETS.items() if part.family.name in CELLS)


class NetlistSimulation(CompiledSimulation):
    """See `CompiledSimulation`; the memories' contents are in the netlist.

    Parameters
    ----------
    target : str
        Part (`gateware.synthesis.targets`), of a family in `CELLS`.

    Raises
    ------
    ToolMissing
        Yosys or Verilator is not installed.
    SynthesisError
        Yosys rejected the core.
    SimulationFailed
        The build failed.
    """

    def __init__(self, core: Core, *, target: str = "xc6slx9", **options: Any) -> None:
        self.target = TARGETS[target]
        super().__init__(core, **options)

    def design(self, core: Core) -> tuple[dict[str, str], dict[str, str]]:
        """See `RtlSimulation.design`."""
        family = self.target.family
        text = core.verilog(instances=family is SPARTAN6, identified=True)
        netlist = netlist_of(text, "core", family).synthesis.netlist
        cells = CELLS[family.name]
        return {"core.v": verilog_of(netlist, "core", cells), **cells.sources()}, {}


def verilog_of(netlist: Mapping[str, Any], top: str, family: Cells) -> str:
    """Verilog of one module of a netlist as yosys writes it to JSON: cells and wires alone."""
    module = netlist["modules"][top]
    ports, cells = module["ports"], module["cells"]
    bits = {bit for cell in cells.values() for b in cell["connections"].values() for bit in b}
    wires = sorted(bit for bit in bits if isinstance(bit, int))
    # A pad's net is the port itself: both sides may drive it.
    pads = {name: port for name, port in ports.items() if port["direction"] == "inout"}
    heads = (f".{name}({_nets(p['bits'])})" if name in pads else name for name, p in ports.items())
    lines = [f"module {top} ({', '.join(heads)});"]
    for name, port in ports.items():
        if name in pads:
            lines += [f"  inout n{bit};" for bit in port["bits"]]
        else:
            lines.append(f"  {port['direction']} [{len(port['bits']) - 1}:0] {name};")
    lines += [f"  wire n{bit};" for bit in wires]
    for name, port in ports.items():
        nets = _nets(port["bits"])
        if name not in pads:
            is_input = port["direction"] == "input"
            lines.append(f"  assign {nets} = {name};" if is_input else f"  assign {name} = {nets};")
    for number, cell in enumerate(cells.values()):
        kind = cell["type"]
        if kind == _NO_HARDWARE:
            continue
        params = ", ".join(
            f".{k}({v})" for k, v in _parameters(cell, family.contents.get(kind, {}))
        )
        pins = cell["connections"]
        if kind in family.vectors:
            pins = _vectors(pins, f"c{number}_", lines)
        connections = ", ".join(f".{k}({_nets(v)})" for k, v in pins.items() if v)
        lines.append(f"  {kind} #({params}) c{number} ({connections});")
    return "\n".join([*lines, "endmodule", ""])


def _nets(bits: Sequence[int | str]) -> str:
    nets = [f"n{b}" if isinstance(b, int) else b if len(b) > 1 else f"1'b{b}" for b in bits]
    return "{" + ", ".join(reversed(nets)) + "}"


def _vectors(
    pins: Mapping[str, Sequence[int | str]], prefix: str, lines: list[str]
) -> dict[str, list[int | str]]:
    """Pins with numbers as vectors; wires for those that are not connected are added to lines."""
    vectors: dict[str, dict[int, int | str]] = {}
    merged: dict[str, list[int | str]] = {}
    for name, bits in pins.items():
        stem = name.rstrip("0123456789")
        if stem == name:
            merged[name] = list(bits)
        elif bits:
            vectors.setdefault(stem, {})[int(name.removeprefix(stem))] = bits[0]
    for stem, numbered in vectors.items():
        merged[stem] = []
        for k in range(max(numbered) + 1):
            if k not in numbered:
                lines.append(f"  wire {prefix}{stem}{k};")
            merged[stem].append(numbered.get(k, f"{prefix}{stem}{k}"))
    return merged


def _parameters(
    cell: Mapping[str, Any], contents: Mapping[str, tuple[str, int, int]]
) -> Iterator[tuple[str, str]]:
    """Parameters as Verilog constants; the contents of a memory as one number."""
    values = dict(cell["parameters"])
    for name in _UNUSED if contents else ():
        values.pop(name, None)
    for kind, (prefix, count, width) in contents.items():
        words = [_bits(values.pop(f"{prefix}{k:02X}", "0")) for k in range(count)]
        values[kind] = "".join(word.rjust(width, "0") for word in reversed(words))
    for name, value in values.items():
        is_bits = value and set(value) <= set("01x")
        yield name, f"{len(value)}'b{value.replace('x', '0')}" if is_bits else f'"{value.strip()}"'


def _bits(value: str) -> str:
    """A number as Lattice writes it, in hexadecimal digits, or already in bits."""
    return value if set(value) <= set("01x") else f"{int(value, 16):b}"
