"""The primitives of Spartan-6, for timing."""

from typing import Final

from boresight.gateware.synthesis.arcs import CellTiming, Primitives
from boresight.gateware.synthesis.netlist import Cell
from boresight.gateware.synthesis.spartan6.celltypes import BLOCK_RAMS, LUTS, SPECIALS, UnknownCell
from boresight.gateware.synthesis.spartan6.dsp_arcs import dsp_timing
from boresight.gateware.synthesis.spartan6.memory_arcs import block_ram_timing, special_timing
from boresight.gateware.synthesis.spartan6.routing import route
from boresight.gateware.synthesis.spartan6.slice_arcs import slice_timing

_CLOCKS: Final = frozenset({"C", "CLK", "WCLK", "CLKA", "CLKB", "CLKAWRCLK", "CLKBRDCLK"})


def cell_timing(cell: Cell) -> CellTiming:
    """Return the timing of any primitive.

    Raises
    ------
    UnknownCell
        The cell's type has no data.
    """
    timing = slice_timing(cell)
    if timing is not None:
        return timing
    if cell.type == "DSP48A1":
        return dsp_timing(cell)
    if cell.type in BLOCK_RAMS:
        return block_ram_timing(cell)
    if cell.type in SPECIALS:
        return special_timing(cell)
    raise UnknownCell(cell=cell.name, type=cell.type, use="timing")


def _clocks(cell: Cell) -> frozenset[str]:
    """Its ports that are clocks."""
    if cell.type in SPECIALS:
        return frozenset()
    return _CLOCKS - {"C"} if cell.type == "DSP48A1" else _CLOCKS


#: Of Spartan-6.
PRIMITIVES: Final = Primitives(timing=cell_timing, route=route, tables=LUTS, clocks=_clocks)
