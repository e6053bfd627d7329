"""Timing of block RAM and of the clock network."""

from boresight.gateware.synthesis.arcs import CellTiming, Inside, Launch, Setup
from boresight.gateware.synthesis.netlist import Cell


def block_ram_timing(cell: Cell) -> CellTiming:
    """Return the timing of a RAMB16BWER or RAMB8BWER.

    Reads are clocked, so no path runs through. A port with its output register (``DOx_REG``)
    answers faster, and adds a hop inside that the minimum period covers.
    """
    t = CellTiming(insides=[Inside("memory", "memory", ("ramb_period",), is_period=True)])
    for port, bits in cell.outputs.items():
        if port.startswith("DO"):
            side = port.removeprefix("DOP").removeprefix("DO")[:1]
            registered = cell.number(f"DO{side}_REG", 0)
            for index in range(len(bits)):
                t.node_of[port, index] = port
            key = "ramb_clk_do_reg" if registered else "ramb_clk_do"
            t.launches.append(Launch(port, "memory", (key,)))
    for port in cell.inputs:
        if port.startswith("ADDR"):
            t.setups.append(Setup(port, None, "memory", ("ramb_address",)))
        elif not port.startswith("CLK"):
            t.setups.append(Setup(port, None, "memory", ("ramb_setup",)))
    return t


def special_timing(cell: Cell) -> CellTiming:
    """Return the timing of a clock, I/O or configuration cell: untimed but for the clock limit."""
    if cell.type.startswith("BUFG"):
        return CellTiming(insides=[Inside("clock", "clock", ("bufg_period",), is_period=True)])
    return CellTiming()
