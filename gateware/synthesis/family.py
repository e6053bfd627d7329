"""What describes a family of FPGAs: its synthesis, cells, registers, router and parts.

Yosys leaves the registers inside a family's multipliers and block RAM unused and puts flip-flops
beside them. `absorb`, a pass over its JSON netlist, uses them: a register of a cell replaces the
flip-flops of all its pins if these have the cell's clock and one enable, no reset and start at 0,
as the register does. The netlist before and after computes the same in every cycle.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

Json = dict[str, Any]
Bit = int | str

_TIED: Final = ("0", "1", "x")


@dataclass(frozen=True, kw_only=True)
class FlipFlop:
    """A type of flip-flop: its ports, and parameters of one that has no enable."""

    #: Type; ports.
    kind: str
    clock: str = "CLK"
    d: str = "D"
    q: str = "Q"
    #: Ports; empty: there is none. With the parameter ``CEMUX``, the enable is 1 or inverted.
    enable: str = ""
    reset: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)
    #: Parameters of one with a rising edge that starts at 0; what is not set is so.
    plain: Mapping[str, str] = field(default_factory=dict)

    def enabled(self, cell: Json) -> tuple[Bit, bool]:
        """Net of the enable of a cell, and whether 1 enables."""
        mux = cell["parameters"].get("CEMUX", "CE").strip()
        if mux == "1" or not self.enable:
            return "1", True
        return cell["connections"][self.enable][0], mux == "CE"

    def is_plain(self, cell: Json) -> bool:
        """Whether a cell has a rising edge, no set or reset, and starts at 0."""
        reset, parameters = cell["connections"].get(self.reset, ["0"]), cell["parameters"]
        return reset == ["0"] and all(parameters.get(k, v) == v for k, v in self.plain.items())


@dataclass(frozen=True, kw_only=True)
class Absorption:
    """A register of a cell."""

    cell: str
    #: Starts of the names of its pins; the rest is a number.
    pins: tuple[str, ...]
    #: Parameter that makes the cell use it, and its values without and with it.
    register: tuple[str, str, str]
    clock: str = "CLK"
    enables: tuple[str, ...] = ("CE",)
    #: Whether it is behind outputs; else in front of inputs.
    output: bool = False
    #: Whether a cell with these parameters has the register.
    applies: Callable[[Json], bool] = lambda parameters: True
    #: Further parameters of a cell that uses it.
    parameters: Mapping[str, str] = field(default_factory=dict)
    #: Port that must carry the same enable; empty: ``enables``, if the cell uses them already.
    agrees: str = ""
    #: Further ports, and constants on them.
    wires: Mapping[str, str] = field(default_factory=dict)
    #: Ports that must be open or 0: resets of the register.
    idle: tuple[str, ...] = ()


def absorb(
    module: Json,
    flip_flops: Sequence[FlipFlop],
    rules: Sequence[Absorption],
    constants: Mapping[str, tuple[str, str]],
) -> int:
    """Use the registers of ``rules``, in their order, and remove flip-flops that are not left over.

    ``module``, flat, as yosys writes it, is changed in place. Returns how many flip-flops it lost.
    """
    cells, kinds = module["cells"], {f.kind: f for f in flip_flops}
    drivers = ((cell, *constants[c]) for cell in cells.values() if (c := cell["type"]) in constants)
    nets: dict[Bit, Bit] = {cell["connections"][port][0]: value for cell, port, value in drivers}
    _exchange(cells, nets)
    before = sum(cell["type"] in kinds for cell in cells.values())
    for rule in rules:
        if such := [cell for cell in cells.values() if cell["type"] == rule.cell]:
            work = _Nets(module, kinds)
            for cell in such:
                _apply(work, rule, cell)
    while idle := _Nets(module, kinds).idle:
        for name in idle:
            del cells[name]
    _exchange(cells, {value: net for net, value in nets.items()})
    return before - sum(cell["type"] in kinds for cell in cells.values())


def _exchange(cells: Mapping[str, Json], bits: Mapping[Bit, Bit]) -> None:
    """Replace bits at all inputs of cells."""
    for cell in cells.values():
        for port, old in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                cell["connections"][port] = [bits.get(bit, bit) for bit in old]


class _Nets:
    """What drives and loads each net; ("", "") loads what leaves the module."""

    def __init__(self, module: Json, kinds: Mapping[str, FlipFlop]) -> None:
        self.cells, self.kinds = module["cells"], kinds
        self.driver: dict[Bit, str] = {}
        self.loads: dict[Bit, set[tuple[str, str]]] = defaultdict(set)
        for port in module["ports"].values():
            if port["direction"] != "input":
                for bit in port["bits"]:
                    self.loads[bit].add(("", ""))
        for name, cell in self.cells.items():
            for port, bits in cell["connections"].items():
                for bit in bits:
                    if cell["port_directions"][port] == "output":
                        self.driver[bit] = name
                    else:
                        self.loads[bit].add((name, port))

    @property
    def idle(self) -> list[str]:
        """Flip-flops that nothing reads."""
        found = ((name, self.kinds.get(cell["type"])) for name, cell in self.cells.items())
        return [n for n, f in found if f and not self.loads[self.cells[n]["connections"][f.q][0]]]

    def flip_flop(self, rule: Absorption, bit: Bit) -> str | None:
        """Name of the flip-flop at a pin; "" if the pin needs none, None if it cannot have it."""
        if rule.output:
            if not (loads := self.loads[bit]):
                return ""
            ((name, port), *others) = loads
        else:
            if bit in ("0", "x"):
                return ""
            name, port, others = self.driver.get(bit, ""), None, []
        kind = self.kinds.get(self.cells.get(name, {"type": ""})["type"])
        if kind is None or others or port not in (None, kind.d):
            return None
        return name if kind.is_plain(self.cells[name]) else None

    def enables(self, name: str) -> Bit | None:
        """Net that is 1 where a flip-flop is enabled; None if the netlist has no such net."""
        net, high = self.kinds[self.cells[name]["type"]].enabled(self.cells[name])
        if high or net in _TIED:
            return net if high else {"0": "1", "1": "0"}.get(str(net))
        inputs, content = self._tables.get(net, ((), 0))
        wanted = inputs, content ^ 0xFFFF
        return next((z for z, table in reversed(self._tables.items()) if table == wanted), None)

    @cached_property
    def _tables(self) -> dict[Bit, tuple[Sequence[Any], int]]:
        """Inputs and content of look-up tables, by their output."""
        return {
            cell["connections"]["Z"][0]: (
                [cell["connections"].get(port, ["0"]) for port in "ABCD"],
                int(cell["parameters"]["INIT"], 2),
            )
            for cell in self.cells.values()
            if cell["type"] == "LUT4"
        }


def _apply(nets: _Nets, rule: Absorption, cell: Json) -> None:
    """Use a register of a cell, if the flip-flops allow it."""
    parameters, wires = cell["parameters"], cell["connections"]
    register, unused, used = rule.register

    def live(*ports: str) -> set[Bit]:
        return {bit for port in ports for bit in wires.get(port, ())} - {"0", "x"}

    free = parameters.get(register, unused) == unused and rule.applies(parameters)
    if live(*rule.idle) or not free:
        return
    moved = {
        (port, k): name
        for port in wires
        if port.rstrip("0123456789") in rule.pins
        for k, bit in enumerate(wires[port])
        if (name := nets.flip_flop(rule, bit)) != ""
    }
    chosen = {name for name in moved.values() if name}
    if not chosen or None in moved.values():
        return
    types = {name: nets.kinds[nets.cells[name]["type"]] for name in chosen}
    clocks = {nets.cells[name]["connections"][f.clock][0] for name, f in types.items()}
    enables = {nets.enables(name) for name in chosen}
    if len(clocks) != 1 or len(enables) != 1 or None in enables or live(rule.clock) - clocks:
        return
    if wires[rule.agrees] != [*enables] if rule.agrees else live(*rule.enables) - enables:
        return
    for (port, k), name in moved.items():
        assert name is not None
        beside = nets.cells[name]["connections"]
        wires[port][k] = beside[types[name].q if rule.output else types[name].d][0]
    for name in chosen if rule.output else ():
        del nets.cells[name]
    parameters.update({register: used, **rule.parameters})
    added = {rule.clock: [*clocks], **dict.fromkeys(rule.enables, [*enables])}
    added |= {port: [net] for port, net in rule.wires.items()}
    wires.update(added)
    cell["port_directions"].update(dict.fromkeys(added, "input"))


@dataclass(frozen=True, kw_only=True)
class Device:
    """One FPGA part."""

    #: Part name without grade or package, lower case.
    name: str
    #: How many of a primitive are on the die, and its name in texts. Keys are ``lut``, ``ff``,
    #: ``dsp``, that of ``memory``, and more of the family's own.
    resources: Mapping[str, tuple[int, str]]
    #: Speed grades with delays, slow first.
    grades: tuple[int, ...]
    #: Key of the block RAM.
    memory: str = "ram"

    def capacity(self, key: str) -> int:
        return self.resources[key][0]

    def unit(self, key: str) -> str:
        return self.resources[key][1]

    def percent(self, key: str, used: float) -> float:
        """Return ``used`` as a percentage of the resource ``key``, 0.01 steps."""
        return round(100.0 * used / self.capacity(key), 2)


@dataclass(frozen=True)
class ClockEstimate:
    """Highest clock of a netlist that is not placed."""

    #: The delay of each net is the median, or the upper quartile, of routed nets with the same
    #: fan-out. The two clocks are the band of the estimate.
    median_mhz: float
    p75_mhz: float

    @property
    def by_nets(self) -> dict[str, float]:
        return {"median": self.median_mhz, "p75": self.p75_mhz}

    @property
    def band(self) -> str:
        return (
            f"{self.p75_mhz:g} to {self.median_mhz:g} MHz (estimate: upper quartile to median "
            "delays of nets, not ISE)"
        )


@dataclass(frozen=True, kw_only=True)
class Router:
    """A place-and-route program, one of nextpnr's."""

    #: Its name, ``nextpnr-ecp5``; its package on PyPI is ``yowasp-`` and this name.
    program: str
    #: Extra of this package that installs it.
    extra: str
    #: Option and file of the pins; of the configuration as text. These and the next two are for
    #: boards.
    pins: tuple[str, str] = ("", "")
    placed: tuple[str, str] = ("", "")
    #: Program that makes the bitstream of that text, with its options; in the same package.
    packer: tuple[str, ...] = ()
    #: File that it makes.
    bitstream: str = ""
    #: Options for the part and a package, with ``{name}`` and ``{size}`` of the part (what follows
    #: the first dash) and ``{grade}``; further ones.
    options: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Family:
    """A family of FPGAs (``docs/targets.md`` says how to add one)."""

    #: Short name; name in texts.
    name: str
    title: str
    #: Command of yosys that maps to its cells, without ``-top``.
    synthesis: str
    #: Type of a cell -> its use of the part's resources, by their keys.
    cells: Mapping[str, Mapping[str, float]]
    #: Its parts, small first.
    devices: tuple[Device, ...]
    #: The first one replaces ports; all can move into registers.
    flip_flops: tuple[FlipFlop, ...] = ()
    #: ``clk`` or ``0`` -> type, parameters and output of the cell that drives it in a core that is
    #: routed without pins; what is not there the router drives.
    drivers: Mapping[str, tuple[str, Mapping[str, str], str]] = field(default_factory=dict)
    #: Words and bits that a block RAM can have -> blocks, halves where it can be divided.
    memory_shapes: Mapping[tuple[int, int], float] = field(default_factory=dict)
    #: (Lanes, depth) -> clock [MHz] of a core of several filters on its smallest part, slowest
    #: grade; what is not there is not chosen by itself.
    clocks: Mapping[tuple[int, int], float] = field(default_factory=dict)
    #: What these clocks are.
    clocks_source: str = ""
    #: None: area, and on Spartan-6 an estimate of the clock.
    router: Router | None = None
    #: Registers of multipliers and memories, in the order of their use.
    registers: tuple[Absorption, ...] = ()
    #: Type of a cell that drives a constant -> its output, and "0" or "1".
    constants: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    #: Type of a cell -> parameter, value and input: with this value nothing is to drive the input.
    opens: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    #: Estimates the clock where there is no router: ``estimate(netlist, top, grade)``.
    estimate: Callable[[Mapping[str, Any], str, int], ClockEstimate | None] = field(
        default=lambda netlist, top, grade: None
    )

    def absorb(self, netlist: dict[str, Any], top: str) -> int:
        """Move flip-flops into registers of multipliers and memories; return how many."""
        module = netlist["modules"][top]
        for cell in module["cells"].values():
            parameter, value, port = self.opens.get(cell["type"], ("", "", ""))
            if port and cell["parameters"][parameter] == value:
                cell["connections"].pop(port, None)
                cell["port_directions"].pop(port, None)
        return absorb(module, self.flip_flops, self.registers, self.constants)


@dataclass(frozen=True)
class Target:
    """A part at a speed grade."""

    name: str
    family: Family
    device: Device
    grade: int

    @property
    def router(self) -> Router:
        """That of its family, which has one."""
        assert self.family.router is not None
        return self.family.router

    @property
    def title(self) -> str:
        graded = len(self.device.grades) > 1
        return f"{self.device.name}, speed {self.grade}" if graded else self.device.name
