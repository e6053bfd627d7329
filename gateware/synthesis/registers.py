"""Registers of multipliers and memories: flip-flops around them move into them.

Yosys leaves the registers inside a family's multipliers and block RAM unused and puts flip-flops
beside them. This pass over its JSON netlist uses them: a register of a cell replaces the flip-flops
of all its pins if these have the cell's clock and one enable, no reset and start at 0, as the
register does. The netlist before and after computes the same in every cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

Json = dict[str, Any]
Bit = int | str


@dataclass(frozen=True, kw_only=True)
class FlipFlop:
    """A flip-flop of a netlist, in terms of any family.

    Attributes
    ----------
    clock, d, q : int or str
        Nets.
    enable : tuple of net and bool
        Clock enable, and whether 1 enables.
    plain : bool
        Rising edge, no set or reset, starts at 0.
    """

    clock: Bit
    d: Bit
    q: Bit
    enable: tuple[Bit, bool]
    plain: bool


@dataclass(frozen=True, kw_only=True)
class Absorption:
    """A register of a cell.

    Attributes
    ----------
    cell : str
        Type of the cell.
    pins : tuple of str
        Starts of the names of its pins; the rest is a number.
    output : bool
        Whether it is behind outputs; else in front of inputs.
    applies : callable
        Whether a cell with these parameters has the register, and does not use it yet.
    parameters : mapping
        Parameters that make it use it.
    clock : str
        Port of its clock.
    enables : tuple of str
        Ports of its enable.
    agrees : str
        Port that must carry the same enable; empty: ``enables``, if the cell uses them already.
    wires : mapping
        Further ports, and constants on them.
    idle : tuple of str
        Ports that must be open or 0: resets of the register.
    """

    cell: str
    pins: tuple[str, ...]
    output: bool
    applies: Callable[[Json], bool]
    parameters: Mapping[str, str]
    clock: str
    enables: tuple[str, ...]
    agrees: str = ""
    wires: Mapping[str, str] = field(default_factory=dict)
    idle: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How a family's netlist is read.

    Attributes
    ----------
    flip_flop : callable
        A cell as `FlipFlop`, None if it is none.
    table : callable
        A cell as inputs, table and output of a look-up table, None if it is none.
    constants : mapping
        Type of a cell that drives a constant -> its output, and "0" or "1".
    """

    flip_flop: Callable[[Json], FlipFlop | None]
    table: Callable[[Json], tuple[tuple[Bit, ...], int, Bit] | None] = lambda cell: None
    constants: Mapping[str, tuple[str, str]] = field(default_factory=dict)


def absorb(netlist: Json, top: str, reading: Reading, rules: tuple[Absorption, ...]) -> int:
    """Use the registers of ``rules``, in their order, and remove flip-flops that are not left over.

    Parameters
    ----------
    netlist : dict
        Flat netlist as yosys writes it; changed in place.

    Returns
    -------
    int
        Flip-flops less.
    """
    cells = netlist["modules"][top]["cells"]
    nets = {
        cell["connections"][output][0]: value
        for cell in cells.values()
        for output, value in (reading.constants.get(cell["type"], ("", "")),)
        if output
    }
    _exchange(cells, nets)
    work = _Netlist(netlist["modules"][top], reading)
    before = len(work.flip_flops)
    for rule in rules:
        for name in [n for n, cell in work.cells.items() if cell["type"] == rule.cell]:
            work.apply(rule, name, work.cells[name])
    work.sweep()
    _exchange(cells, {value: net for net, value in nets.items()})
    return before - len(work.flip_flops)


def _exchange(cells: Mapping[str, Json], bits: Mapping[Bit, Bit]) -> None:
    """Replace bits at all inputs of cells."""
    for cell in cells.values():
        for port, old in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                cell["connections"][port] = [bits.get(bit, bit) for bit in old]


_TIED: Final = ("0", "1", "x")


class _Netlist:
    """Cells by name, with what drives and loads each net."""

    def __init__(self, module: Json, reading: Reading) -> None:
        self.cells: dict[str, Json] = module["cells"]
        self.flip_flops: dict[str, FlipFlop] = {}
        self.driver: dict[Bit, str] = {}
        self.loads: dict[Bit, set[tuple[str, str]]] = {}
        self.tables: dict[Bit, tuple[tuple[Bit, ...], int]] = {}
        leaving = {
            bit
            for port in module["ports"].values()
            if port["direction"] != "input"
            for bit in port["bits"]
        }
        for bit in leaving:
            self.loads.setdefault(bit, set()).add(("", ""))
        for name, cell in self.cells.items():
            if (flip_flop := reading.flip_flop(cell)) is not None:
                self.flip_flops[name] = flip_flop
            if (table := reading.table(cell)) is not None:
                inputs, content, output = table
                self.tables[output] = (inputs, content)
            for port, bits in cell["connections"].items():
                for bit in bits:
                    if cell["port_directions"][port] == "output":
                        self.driver[bit] = name
                    elif bit not in _TIED:
                        self.loads.setdefault(bit, set()).add((name, port))
        self.outputs = {table: output for output, table in self.tables.items()}

    def enables(self, flip_flop: FlipFlop) -> Bit | None:
        """Net that is 1 where the flip-flop is enabled; None if the netlist has no such net."""
        net, high = flip_flop.enable
        if high or net in _TIED:
            return net if high else {"0": "1", "1": "0"}.get(str(net))
        if net not in self.tables:
            return None
        inputs, content = self.tables[net]
        return self.outputs.get((inputs, content ^ (1 << (1 << len(inputs))) - 1))

    def apply(self, rule: Absorption, name: str, cell: Json) -> None:
        """Use a register of a cell, if the flip-flops allow it."""
        parameters, wires = cell["parameters"], cell["connections"]
        reset = {bit for port in rule.idle for bit in wires.get(port, ())} - {"0", "x"}
        if reset or not rule.applies(parameters):
            return
        moved = {
            (port, k): neighbour
            for port in wires
            if port.rstrip("0123456789") in rule.pins
            for k, bit in enumerate(wires[port])
            if (neighbour := self._flip_flop_at(rule, bit)) != ""
        }
        if not moved or None in moved.values():
            return
        chosen = [self.flip_flops[flip_flop] for flip_flop in moved.values() if flip_flop]
        clocks = {flip_flop.clock for flip_flop in chosen}
        enables = {self.enables(flip_flop) for flip_flop in chosen}
        at_hand = {*wires.get(rule.clock, ())} - {"0", "x"}
        enabled = {bit for port in rule.enables for bit in wires.get(port, ())} - {"0", "x"}
        if len(clocks) != 1 or len(enables) != 1:
            return
        (clock,), (enable,) = clocks, enables
        if enable is None:
            return
        if not at_hand <= {clock} or (rule.agrees and wires[rule.agrees] != [enable]):
            return
        if not rule.agrees and not enabled <= {enable}:
            return
        for (port, k), flip_flop_name in moved.items():
            if flip_flop_name:
                self._move(rule, name, port, k, flip_flop_name)
        parameters.update(rule.parameters)
        added = {rule.clock: clock, **dict.fromkeys(rule.enables, enable), **rule.wires}
        for port, net in added.items():
            wires[port] = [net]
            cell["port_directions"][port] = "input"
            if net not in _TIED:
                self.loads.setdefault(net, set()).add((name, port))

    def _flip_flop_at(self, rule: Absorption, bit: Bit) -> str | None:
        """Name of the flip-flop at a pin; "" if the pin needs none, None if it cannot have it."""
        if rule.output:
            loads = self.loads.get(bit, set())
            if not loads:
                return ""
            ((name, _), *other_loads) = loads
            fits = not other_loads and name in self.flip_flops and self.flip_flops[name].d == bit
        else:
            if bit in ("0", "x"):
                return ""
            name = self.driver.get(bit, "")
            fits = name in self.flip_flops
        return name if fits and self.flip_flops[name].plain else None

    def _move(self, rule: Absorption, name: str, port: str, k: int, flip_flop_name: str) -> None:
        flip_flop, bits = self.flip_flops[flip_flop_name], self.cells[name]["connections"][port]
        before = bits[k]
        if rule.output:
            self.loads.pop(before)
            bits[k] = flip_flop.q
            self.driver[flip_flop.q] = name
            self._remove(flip_flop_name)
        else:
            bits[k] = flip_flop.d
            if before not in bits:
                self.loads[before].discard((name, port))
            if flip_flop.d not in _TIED:
                self.loads.setdefault(flip_flop.d, set()).add((name, port))

    def _remove(self, name: str) -> None:
        for port, bits in self.cells.pop(name)["connections"].items():
            for bit in bits:
                self.loads.get(bit, set()).discard((name, port))
        del self.flip_flops[name]

    def sweep(self) -> None:
        """Remove flip-flops that nothing reads any more."""
        idle = [n for n, f in self.flip_flops.items() if not self.loads.get(f.q)]
        for name in idle:
            self._remove(name)
        if idle:
            self.sweep()
