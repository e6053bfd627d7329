"""Timing arcs of a cell, and of the nets between cells, by names of delays.

A cell's outputs are grouped into *nodes*: all output bits of a node become valid together. An
:class:`Arc` runs from an input pin through the cell to a node, a :class:`Launch` starts a path at
a register inside the cell, a :class:`Setup` ends one, and an :class:`Inside` check lies wholly
in the cell. Each holds names of a family's delays (:mod:`gateware.synthesis.spartan6.delays`);
several names add up. :class:`Primitives` is all of a family.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from boresight.gateware.synthesis.netlist import Cell, Netlist, Pin

Keys = tuple[str, ...]


@dataclass(frozen=True)
class Arc:
    """From ``port`` (bit ``index``, or every bit if None) to the output ``node``."""

    port: str
    index: int | None
    node: str
    keys: Keys


@dataclass(frozen=True)
class Launch:
    """From the clock of register ``start`` to the output ``node``."""

    node: str
    start: str
    keys: Keys


@dataclass(frozen=True)
class Setup:
    """From ``port`` (bit ``index``, or every bit if None) to the clock of register ``end``."""

    port: str
    index: int | None
    end: str
    keys: Keys


@dataclass(frozen=True)
class Inside:
    """From register ``start`` to register ``end`` of the same cell.

    A minimum clock period of the cell has ``is_period`` set.
    """

    start: str
    end: str
    keys: Keys
    is_period: bool = False


@dataclass
class CellTiming:
    """All timing of one cell.

    Attributes
    ----------
    node_of : dict
        (output port, bit) -> node name; an output bit not listed is untimed.
    """

    node_of: dict[tuple[str, int], str] = field(default_factory=dict)
    arcs: list[Arc] = field(default_factory=list)
    launches: list[Launch] = field(default_factory=list)
    setups: list[Setup] = field(default_factory=list)
    insides: list[Inside] = field(default_factory=list)


@dataclass(frozen=True)
class Hop:
    """One net from driver to load.

    Attributes
    ----------
    net : str
        Name of the net delay, empty for a wire inside a slice.
    entry : Keys
        Delays of logic that the load needs in front of it.
    in_slice : bool
        The driver's LUT sits in the load's slice.
    """

    net: str
    entry: Keys = ()
    in_slice: bool = False


@dataclass(frozen=True, kw_only=True)
class Primitives:
    """The primitives of a family, for timing.

    Attributes
    ----------
    timing : callable
        Timing of a cell.
    route : callable
        The hop over net ``bit`` from a driver to a load, by netlist, bit, driver, load and the
        number of pins on it, those after absorbed inverters included.
    tables : set of str
        Types of look-up tables, which absorb an inverter before them.
    clocks : callable
        Ports of a cell that are clocks.
    """

    timing: Callable[[Cell], CellTiming]
    route: Callable[[Netlist, int, Pin, Pin, int], Hop]
    tables: frozenset[str]
    clocks: Callable[[Cell], frozenset[str]]
