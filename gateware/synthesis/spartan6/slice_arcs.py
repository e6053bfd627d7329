"""Timing of slices: flip-flops, LUTs, carry, wide multiplexers, SRL and LUT RAM."""

import re

from boresight.gateware.synthesis.arcs import Arc, CellTiming, Launch, Setup
from boresight.gateware.synthesis.netlist import Cell, NetlistError
from boresight.gateware.synthesis.spartan6.celltypes import (
    FLIP_FLOPS,
    LATCHES,
    LUTRAMS,
    LUTS,
    SHIFT_REGISTERS,
)


def slice_timing(cell: Cell) -> CellTiming | None:
    """Return the timing of ``cell``, or None if it is not a slice primitive."""
    if cell.type in LUTS or cell.type == "INV":
        return _lut(cell)
    if cell.type in FLIP_FLOPS:
        return _flip_flop(cell)
    if cell.type in ("MUXF7", "MUXF8"):
        return _wide_mux(cell)
    if cell.type == "CARRY4":
        return _carry(cell)
    if cell.type in SHIFT_REGISTERS:
        return _shift_register(cell)
    if cell.type in LUTRAMS:
        return _lutram(cell)
    if cell.type in LATCHES:
        raise NetlistError(
            f"storage must be edge-triggered for timing, not a latch ({cell.type} {cell.name})"
        )
    return None


def _require_rising(cell: Cell, *params: str) -> None:
    """Refuse the falling edge: a half-period path would be counted as a whole one."""
    if cell.type.endswith("_1") or any(cell.number(param, 0) for param in params):
        raise NetlistError(
            f"clock edge must be rising for timing, not falling ({cell.type} {cell.name})"
        )


def _lut(cell: Cell) -> CellTiming:
    t = CellTiming()
    for port in cell.outputs:
        t.node_of[port, 0] = port
        t.arcs += [Arc(pin, None, port, ("lut",)) for pin in cell.inputs]
    return t


def _flip_flop(cell: Cell) -> CellTiming:
    _require_rising(cell, "IS_C_INVERTED")
    t = CellTiming(node_of={("Q", 0): "Q"}, launches=[Launch("Q", "Q", ("ff_clk_q",))])
    t.setups.append(Setup("D", None, "Q", ("ff_d",)))
    t.setups.append(Setup("CE", None, "Q", ("ff_ce",)))
    t.setups += [Setup(pin, None, "Q", ("ff_sr",)) for pin in ("R", "S", "CLR", "PRE")]
    return t


def _wide_mux(cell: Cell) -> CellTiming:
    data = ("mux7",) if cell.type == "MUXF7" else ("mux8",)
    t = CellTiming(node_of={("O", 0): "O"})
    t.arcs += [Arc("I0", None, "O", data), Arc("I1", None, "O", data)]
    t.arcs.append(Arc("S", None, "O", ("mux_select",)))
    return t


def _carry(cell: Cell) -> CellTiming:
    """Return the arcs of a carry chain of four.

    Bit k enters at S[k] (always from a LUT) or DI[k] and can reach O[i] and CO[i] for i >= k,
    except that DI[k] first shows in the sum one bit higher. CO[3] goes on to the next slice;
    CO[0..2] can only leave through the slice's output multiplexer.
    """
    t = CellTiming()
    for i in range(4):
        t.node_of["O", i] = f"O{i}"
        t.node_of["CO", i] = f"CO{i}"
        leaving = () if i == 3 else ("carry_exit",)
        through = ("carry_ci_co",) if i == 3 else (f"carry_ci_o{i}",)
        for k in range(i + 1):
            t.arcs.append(Arc("S", k, f"O{i}", (f"carry_s{k}_o{i}",)))
            if k < i:
                t.arcs.append(Arc("DI", k, f"O{i}", (f"carry_s{k}_o{i}", "carry_di_o")))
            t.arcs.append(Arc("S", k, f"CO{i}", (f"carry_s{k}_co", *leaving)))
            t.arcs.append(Arc("DI", k, f"CO{i}", (f"carry_di{k}_co", *leaving)))
        t.arcs.append(Arc("CI", None, f"O{i}", (f"carry_ci_o{i}",)))
        t.arcs.append(Arc("CYINIT", None, f"O{i}", (f"carry_ci_o{i}", "carry_cyinit")))
        t.arcs.append(Arc("CI", None, f"CO{i}", through))
        t.arcs.append(Arc("CYINIT", None, f"CO{i}", (*through, "carry_cyinit")))
    return t


def _shift_register(cell: Cell) -> CellTiming:
    """Return the arcs of an SRL: the address reads at once, the data waits for the clock."""
    _require_rising(cell, "IS_CLK_INVERTED")
    t = CellTiming()
    for port in cell.outputs:
        t.node_of[port, 0] = port
        t.launches.append(Launch(port, "shift", ("srl_clk_q",)))
    address = [pin for pin in cell.inputs if pin.startswith("A")]
    t.arcs += [Arc(pin, None, "Q", ("srl_address",)) for pin in address if "Q" in cell.outputs]
    t.setups += [Setup(pin, None, "shift", ("srl_setup",)) for pin in ("D", "CE")]
    return t


def _lutram(cell: Cell) -> CellTiming:
    """Return the arcs of a distributed RAM: asynchronous read, clocked write.

    Output to read-address port: ``DOx`` to ``ADDRx``, ``DPO`` to ``DPRA``, ``SPO`` and ``O`` to
    ``A``. The write address is ``ADDRD`` or ``A``.
    """
    _require_rising(cell, "IS_WCLK_INVERTED")
    t = CellTiming()
    for port, bits in cell.outputs.items():
        for index in range(len(bits)):
            t.node_of[port, index] = port
        t.launches.append(Launch(port, "memory", ("lutram_clk_q",)))
        if port.startswith("DO"):
            prefix = "ADDR" + port[2:]
        else:
            prefix = "DPRA" if port == "DPO" else "A"
        t.arcs += [Arc(p, None, port, ("lutram_address",)) for p in _starting(cell, prefix)]
    write = [*_starting(cell, "ADDRD"), *_starting(cell, "A")]
    data = [p for p in cell.inputs if p == "D" or (p.startswith("DI") and len(p) == 3)]
    for pin in [*write, *data, "WE"]:
        t.setups.append(Setup(pin, None, "memory", ("lutram_setup",)))
    return t


def _starting(cell: Cell, prefix: str) -> list[str]:
    """Return the input ports named ``prefix`` or ``prefix`` and a number (A, A0, DPRA3)."""
    return [p for p in cell.inputs if re.fullmatch(prefix + r"\d*", p)]
