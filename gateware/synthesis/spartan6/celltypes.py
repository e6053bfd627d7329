"""The primitives that a netlist for Spartan-6 may hold, by kind.

Area counting and timing both ask here, so that a primitive known to one cannot be forgotten by
the other. A primitive in none of the sets is an error, never ignored.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final


class UnknownCell(ValueError):
    """The netlist holds a cell type that this package has no data for."""

    def __init__(self, *, cell: str, type: str, use: str) -> None:
        super().__init__(
            f"cell type must be a Spartan-6 primitive with {use} data, not {type!r} (cell {cell})"
        )


#: Logic functions, one LUT6 each.
LUTS: Final = frozenset({"LUT1", "LUT2", "LUT3", "LUT4", "LUT5", "LUT6", "LUT6_2"})
#: Rising-edge flip-flops; the ``_1`` forms clock on the falling edge.
FLIP_FLOPS: Final = frozenset(
    name + edge for name in ("FDRE", "FDSE", "FDCE", "FDPE") for edge in ("", "_1")
)
#: Transparent latches; they take a flip-flop's place.
LATCHES: Final = frozenset({"LDCE", "LDPE"})
#: Shift registers, one LUT each.
SHIFT_REGISTERS: Final = frozenset({"SRL16", "SRL16E", "SRLC16", "SRLC16E", "SRLC32E"})
#: LUT RAM -> LUTs that it takes.
LUTRAMS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "RAM16X1S": 1,
        "RAM32X1S": 1,
        "RAM64X1S": 1,
        "RAM128X1S": 2,
        "RAM256X1S": 4,
        "RAM16X1D": 2,
        "RAM32X1D": 2,
        "RAM64X1D": 2,
        "RAM128X1D": 4,
        "RAM32M": 4,
        "RAM64M": 4,
    }
)
#: Block RAM -> share of one RAMB16 site.
BLOCK_RAMS: Final[Mapping[str, float]] = MappingProxyType({"RAMB16BWER": 1.0, "RAMB8BWER": 0.5})
#: Clock, I/O, configuration and constant cells: no slice logic, and paths start or end there
#: untimed.
SPECIALS: Final = frozenset(
    {
        *("GND", "VCC", "PULLUP", "PULLDOWN", "KEEPER"),
        *("BUFG", "BUFGCE", "BUFGMUX", "BUFH", "BUFIO2"),
        *("DCM_SP", "DCM_CLKGEN", "PLL_BASE", "PLL_ADV"),
        *("IBUF", "IBUFG", "IBUFDS", "IBUFGDS", "OBUF", "OBUFT", "OBUFDS", "IOBUF"),
        *("IDDR2", "ODDR2", "IODELAY2", "ISERDES2", "OSERDES2"),
        *("STARTUP_SPARTAN6", "ICAP_SPARTAN6", "BSCAN_SPARTAN6", "DNA_PORT"),
    }
)
