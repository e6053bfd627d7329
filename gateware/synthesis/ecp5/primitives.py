"""The primitives of ECP5, for the timing of a netlist that is not placed.

With these the method of the Spartan-6 estimate is held against what nextpnr routed
(`gateware.synthesis.calibration`). Where nextpnr routes, nothing of this is needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from boresight.gateware.synthesis.arcs import Arc, CellTiming, Hop, Launch, Primitives, Setup
from boresight.gateware.synthesis.netlist import Cell, Netlist, Pin
from boresight.gateware.synthesis.spartan6.delays import Delay, DelayTable, fanout_key

__all__ = ["PRIMITIVES", "delay_table"]

_SOURCE: Final = "Project Trellis' database, speed 6, slowest corner and pin, which nextpnr uses"
#: Delays of cells, ns.
_CELLS: Final[Mapping[str, float]] = {
    "ff_clk_q": 0.525,
    "ff_d": 0.0,
    "ff_d_lut": 0.0,
    "ff_ce": 0.0,
    "ff_lsr": 0.424,
    "lut": 0.236,
    "mux_pfumx": 0.165,
    "mux_l6mux21": 0.242,
    "mux_select": 0.256,
    "carry_sum": 0.236,
    "carry_next": 0.714,
    "carry_in": 0.447,
    "carry_through": 0.071,
    "carry_out": 0.474,
    "table_clk_do": 0.929,
    "table_setup": 0.392,
    "memory": 5.830,
    "memory_reg": 0.973,
    "memory_ad": 0.251,
    "memory_ce": 0.340,
    "memory_cs": 0.020,
    "memory_di": 0.218,
    "memory_oce": 0.253,
    "memory_rst": 0.585,
    "memory_we": 0.139,
    "product_reg": 0.735,
    "factor_product": 3.486,
    "factor_product_setup": 3.486,
    "factor_setup": 0.252,
    "factor_reg_product": 3.486,
    "factor_enable": 0.252,
}
#: Wires between cells of a slice, from type and port to type and port.
_IN_SLICE: Final = frozenset(
    {
        ("LUT4", "Z", "PFUMX", "ALUT"),
        ("LUT4", "Z", "PFUMX", "BLUT"),
        ("PFUMX", "Z", "L6MUX21", "D0"),
        ("PFUMX", "Z", "L6MUX21", "D1"),
        ("L6MUX21", "Z", "L6MUX21", "D0"),
        ("L6MUX21", "Z", "L6MUX21", "D1"),
        ("CCU2C", "COUT", "CCU2C", "CIN"),
    }
)
#: Outputs that can be in front of the flip-flop of a slice.
_BEFORE: Final = frozenset(
    {("LUT4", "Z"), ("PFUMX", "Z"), ("L6MUX21", "Z"), ("CCU2C", "S0"), ("CCU2C", "S1")}
)


def delay_table(nets: Mapping[str, float], *, name: str) -> DelayTable:
    """Delays of speed 6, with those of nets by `fanout_key`."""
    delays = {key: Delay(ns, _SOURCE) for key, ns in _CELLS.items()}
    delays["clock_uncertainty"] = Delay(0.0, "nextpnr counts none")
    delays |= {
        key: Delay(ns, f"{name} of nets on paths that limit the clock") for key, ns in nets.items()
    }
    return DelayTable(grade=6, nets=name, delays=delays)


def _timing(cell: Cell) -> CellTiming:
    t = CellTiming()
    for port, bits in cell.outputs.items():
        for index in range(len(bits)):
            t.node_of[port, index] = port
    kind = cell.type
    if kind == "LUT4":
        t.arcs += [Arc(pin, None, "Z", ("lut",)) for pin in "ABCD"]
    elif kind in ("PFUMX", "L6MUX21"):
        data, select = f"mux_{kind.lower()}", "C0" if kind == "PFUMX" else "SD"
        t.arcs += [
            Arc(pin, None, "Z", ("mux_select" if pin == select else data,)) for pin in cell.inputs
        ]
    elif kind == "CCU2C":
        _carry(t)
    elif kind == "TRELLIS_FF":
        t.launches.append(Launch("Q", "Q", ("ff_clk_q",)))
        t.setups += [
            Setup(p, None, "Q", (f"ff_{k}",))
            for p, k in (("DI", "d"), ("CE", "ce"), ("LSR", "lsr"))
        ]
    elif kind == "TRELLIS_DPR16X4":
        t.arcs.append(Arc("RAD", None, "DO", ("lut",)))
        t.launches.append(Launch("DO", "memory", ("table_clk_do",)))
        t.setups += [Setup(p, None, "memory", ("table_setup",)) for p in ("DI", "WAD", "WRE")]
    elif kind == "DP16KD":
        _memory(cell, t)
    elif kind == "MULT18X18D":
        _multiplier(cell, t)
    return t


def _carry(t: CellTiming) -> None:
    for bit, sums in ((0, ("S0", "S1")), (1, ("S1",))):
        for pin in "ABCD":
            t.arcs += [
                Arc(f"{pin}{bit}", None, s, ("carry_sum" if s == f"S{bit}" else "carry_next",))
                for s in sums
            ]
            t.arcs.append(Arc(f"{pin}{bit}", None, "COUT", ("carry_in",)))
    t.arcs += [Arc("CIN", None, s, ("carry_out",)) for s in ("S0", "S1")]
    t.arcs.append(Arc("CIN", None, "COUT", ("carry_through",)))


def _memory(cell: Cell, t: CellTiming) -> None:
    for port in cell.outputs:
        registered = cell.text(f"REGMODE_{port[2]}", "NOREG") == "OUTREG"
        t.launches.append(Launch(port, "memory", ("memory_reg" if registered else "memory",)))
    for port in cell.inputs:
        if not port.startswith("CLK"):
            kind = port.rstrip("0123456789AB")
            t.setups.append(Setup(port, None, "memory", (f"memory_{kind.lower()}",)))


def _multiplier(cell: Cell, t: CellTiming) -> None:
    used = {r: cell.text(f"REG_{r}_CLK", "NONE") != "NONE" for r in ("INPUTA", "INPUTB", "OUTPUT")}
    outputs = [port for port in cell.outputs if port.startswith("P")]
    for port in outputs:
        if used["OUTPUT"]:
            t.launches.append(Launch(port, "P", ("product_reg",)))
    for port in cell.inputs:
        if port[0] not in "AB":
            continue
        if used[f"INPUT{port[0]}"]:
            t.setups.append(Setup(port, None, port[0], ("factor_setup",)))
            if not used["OUTPUT"]:
                t.launches += [Launch(out, port[0], ("factor_reg_product",)) for out in outputs]
        elif used["OUTPUT"]:
            t.setups.append(Setup(port, None, "P", ("factor_product_setup",)))
        else:
            t.arcs += [Arc(port, None, out, ("factor_product",)) for out in outputs]
    t.setups += [Setup(p, None, "enable", ("factor_enable",)) for p in cell.inputs if p[:2] == "CE"]


def _route(netlist: Netlist, bit: int, driver: Pin, load: Pin, fanout: int) -> Hop:
    source, target = netlist.cells[driver.cell].type, netlist.cells[load.cell].type
    if (source, driver.port, target, load.port) in _IN_SLICE:
        return Hop("")
    direct = target == "TRELLIS_FF" and load.port == "DI" and fanout == 1
    if direct and (source, driver.port) in _BEFORE:
        return Hop("", in_slice=True)
    return Hop(fanout_key(fanout))


#: Of ECP5.
PRIMITIVES: Final = Primitives(
    timing=_timing,
    route=_route,
    tables=frozenset({"LUT4"}),
    clocks=lambda cell: frozenset({"CLK", "WCK", "CLKA", "CLKB", "CLK0"}),
)
