"""Timing arcs of a cell, by names of delays.

A cell's outputs are grouped into *nodes*: all output bits of a node become valid together. An
:class:`Arc` runs from an input pin through the cell to a node, a :class:`Launch` starts a path at
a register inside the cell, a :class:`Setup` ends one, and an :class:`Inside` check lies wholly
in the cell. Each holds names of :mod:`gateware.synthesis.spartan6.delays`; several names add up.
"""

from dataclasses import dataclass, field

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
