"""Description of a family of FPGAs: its synthesis, cells, registers, router and parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from boresight.gateware.synthesis.device import Device

#: Command of yosys. The scheduler never reads a register in the cycle in which it is written, and
#: the bank of results that is written is not read: these memories need no logic for the old word.
NO_RW_CHECK: Final = "setattr -set no_rw_check 1 *operands*/m:* *results*/m:*; "


@dataclass(frozen=True, kw_only=True)
class Step:
    """A step of a timing path: through a cell or along a net.

    Attributes
    ----------
    kind : str
        ``clk-to-q``, ``logic``, ``routing`` or ``setup``, as nextpnr names them.
    ns : float
    start, end : str
        Cell and port.
    net : str
        Name of a net.
    """

    kind: str
    ns: float
    start: str
    end: str
    net: str = ""


@dataclass(frozen=True)
class ClockEstimate:
    """Highest clock of a netlist that is not placed.

    Attributes
    ----------
    median_mhz, p75_mhz : float
        The delay of each net is the median, or the upper quartile, of routed nets with the same
        fan-out. The two clocks are the band of the estimate.
    path : tuple of Step
        The longest path with the latter.
    """

    median_mhz: float
    p75_mhz: float
    path: tuple[Step, ...]

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
    """A place-and-route program, one of nextpnr's.

    Attributes
    ----------
    program : str
        Its name, ``nextpnr-ecp5``; its package on PyPI is ``yowasp-`` and this name.
    extra : str
        Extra of this package that installs it.
    options : tuple of str
        Further options than those of the part.
    grades : mapping
        Speed grade -> its name in the options of a part, if that is not its number.
    untimed : set of str
        Types of cells that the program has no delays of: with these it gives no clock.
    pins, placed : (str, str)
        Option and file of the pins; of the configuration as text. These and the next two are for
        boards.
    packer : tuple of str
        Program that makes the bitstream of that text, with its options; in the same package.
    bitstream : str
        File that it makes.
    """

    program: str
    extra: str
    pins: tuple[str, str] = ("", "")
    placed: tuple[str, str] = ("", "")
    packer: tuple[str, ...] = ()
    bitstream: str = ""
    options: tuple[str, ...] = ()
    grades: Mapping[int, str] = field(default_factory=dict)
    untimed: frozenset[str] = frozenset()


@dataclass(frozen=True, kw_only=True)
class Family:
    """A family of FPGAs (``docs/targets.md`` says how to add one).

    Attributes
    ----------
    name, title : str
        Short name; name in texts.
    synthesis : str
        Command of yosys that maps to its cells, without ``-top``.
    cells : mapping
        Type of a cell -> its use of the part's resources, by their keys.
    flip_flop : tuple
        Type, parameters, clock, input and output of a flip-flop without enable.
    drivers : mapping
        ``clk`` or ``0`` -> type, parameters and output of the cell that drives it in a core that is
        routed without pins; what is not there the router drives. None: nothing drives it.
    devices : tuple of Device
        Its parts, small first.
    memory_shapes : mapping
        Words and bits that a block RAM can have -> blocks, halves where it can be divided.
    clocks : mapping
        (Lanes, depth) -> clock [MHz] of a core of several filters on its smallest part, slowest
        grade; what is not there is not chosen by itself.
    clocks_source : str
        What these clocks are.
    router : Router, optional
        None: area, and on Spartan-6 an estimate of the clock.
    absorb : callable
        Moves flip-flops into registers of multipliers and memories: ``absorb(netlist, top)``.
    estimate : callable
        Estimates the clock where there is no router: ``estimate(netlist, top, grade)``.
    """

    name: str
    title: str
    synthesis: str
    cells: Mapping[str, Mapping[str, float]]
    devices: tuple[Device, ...]
    flip_flop: tuple[str, Mapping[str, str], str, str, str] = ("", {}, "", "", "")
    drivers: Mapping[str, tuple[str, Mapping[str, str], str] | None] = field(default_factory=dict)
    memory_shapes: Mapping[tuple[int, int], float] = field(default_factory=dict)
    clocks: Mapping[tuple[int, int], float] = field(default_factory=dict)
    clocks_source: str = ""
    router: Router | None = None
    absorb: Callable[[dict[str, Any], str], int] = field(default=lambda netlist, top: 0)
    estimate: Callable[[Mapping[str, Any], str, int], ClockEstimate | None] = field(
        default=lambda netlist, top, grade: None
    )


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
