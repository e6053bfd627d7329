"""What describes a family of FPGAs: its synthesis, cells, registers, router and parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from boresight.gateware.synthesis.registers import Absorption, FlipFlop, absorb


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
        """Return how many of the resource ``key`` the part holds."""
        return self.resources[key][0]

    def unit(self, key: str) -> str:
        """Return the name of the resource ``key``."""
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
        """Clock by the statistic of nets."""
        return {"median": self.median_mhz, "p75": self.p75_mhz}

    @property
    def band(self) -> str:
        """Both clocks, for texts."""
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
    #: Speed grade -> its name in the options, if that is not its number.
    grades: Mapping[int, str] = field(default_factory=dict)
    #: Types of cells that the program has no delays of: with these it gives no clock.
    untimed: frozenset[str] = frozenset()


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
    #: routed without pins; what is not there the router drives. None: nothing drives it.
    drivers: Mapping[str, tuple[str, Mapping[str, str], str] | None] = field(default_factory=dict)
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
    def title(self) -> str:
        """Part and speed grade, for texts."""
        graded = len(self.device.grades) > 1
        return f"{self.device.name}, speed {self.grade}" if graded else self.device.name
