"""Resources of the part that a netlist uses.

Figures are what yosys mapped, before packing: ISE may share a LUT between two small functions, or
add route-through LUTs, so its map report can differ either way.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from boresight.gateware.synthesis.device import Device
from boresight.gateware.synthesis.netlist import Netlist
from boresight.gateware.synthesis.spartan6.celltypes import (
    BLOCK_RAMS,
    FLIP_FLOPS,
    LATCHES,
    LUTRAMS,
    LUTS,
    SHIFT_REGISTERS,
    SPECIALS,
    UnknownCell,
)
from boresight.gateware.synthesis.spartan6.device import XC6SLX9


@dataclass(frozen=True, kw_only=True)
class Area:
    """Primitive counts of one netlist.

    Attributes
    ----------
    lut_logic : int
        LUT1 to LUT6.
    lut_inv : int
        Inverters left in the netlist; each needs a LUT where it feeds a carry chain or
        a register, so each is counted as one.
    lut_srl : int
        Shift-register LUTs.
    lut_ram : int
        LUTs taken by distributed RAM.
    route_through : int
        Carry or F7 inputs without a LUT in front. Those inputs have no other
        entry, so ISE spends a LUT on each. Not part of ``lut``.
    ff : int
        Flip-flops and latches.
    carry4, muxf7, muxf8, dsp : int
        Cells of that kind.
    ramb16_cells, ramb8_cells : int
        Block RAM cells as mapped.
    special : mapping
        Clock, I/O and configuration cells by type.
    cells : mapping
        Every cell type and its count.
    """

    lut_logic: int
    lut_inv: int
    lut_srl: int
    lut_ram: int
    route_through: int
    ff: int
    carry4: int
    muxf7: int
    muxf8: int
    dsp: int
    ramb16_cells: int
    ramb8_cells: int
    special: Mapping[str, int]
    cells: Mapping[str, int]

    @property
    def lut(self) -> int:
        """LUTs in all: logic, inverters, shift registers and distributed RAM."""
        return self.lut_logic + self.lut_inv + self.lut_srl + self.lut_ram

    @property
    def ramb16(self) -> float:
        """Block RAM in 18 Kbit sites; a RAMB8 takes half of one."""
        whole, half = BLOCK_RAMS["RAMB16BWER"], BLOCK_RAMS["RAMB8BWER"]
        return whole * self.ramb16_cells + half * self.ramb8_cells

    def used(self) -> dict[str, float]:
        """Return the amounts by the resource keys of :class:`Device`."""
        return {
            "lut": self.lut,
            "lut_ram": self.lut_ram + self.lut_srl,
            "ff": self.ff,
            "carry4": self.carry4,
            "dsp": self.dsp,
            "ramb16": self.ramb16,
            "bufg": sum(n for name, n in self.special.items() if name.startswith("BUFG")),
        }

    def percent(self, device: Device = XC6SLX9) -> dict[str, float]:
        """Return :meth:`used` as percentages of ``device``."""
        return {key: device.percent(key, amount) for key, amount in self.used().items()}

    def overfull(self, device: Device = XC6SLX9) -> tuple[str, ...]:
        """Return the resources of which ``device`` has too few."""
        return tuple(k for k, n in self.used().items() if n > device.capacity(k))


def count_area(netlist: Netlist) -> Area:
    """Count the primitives of ``netlist``.

    Raises
    ------
    UnknownCell
        The netlist holds a type that is not a known Spartan-6 primitive.
    """
    count = Counter(cell.type for cell in netlist.cells.values())
    counted = {*LUTS, *FLIP_FLOPS, *LATCHES, *SHIFT_REGISTERS, *LUTRAMS, *BLOCK_RAMS, *SPECIALS}
    counted |= {"INV", "CARRY4", "MUXF7", "MUXF8", "DSP48A1"}
    for cell in netlist.cells.values():
        if cell.type not in counted:
            raise UnknownCell(cell=cell.name, type=cell.type, use="area")

    def total(types: frozenset[str]) -> int:
        return sum(n for name, n in count.items() if name in types)

    return Area(
        lut_logic=total(LUTS),
        lut_inv=count["INV"],
        lut_srl=total(SHIFT_REGISTERS),
        lut_ram=sum(LUTRAMS[name] * n for name, n in count.items() if name in LUTRAMS),
        route_through=_route_through(netlist),
        ff=total(FLIP_FLOPS | LATCHES),
        carry4=count["CARRY4"],
        muxf7=count["MUXF7"],
        muxf8=count["MUXF8"],
        dsp=count["DSP48A1"],
        ramb16_cells=count["RAMB16BWER"],
        ramb8_cells=count["RAMB8BWER"],
        special={name: n for name, n in sorted(count.items()) if name in SPECIALS},
        cells=dict(sorted(count.items())),
    )


def _route_through(netlist: Netlist) -> int:
    """Count the CARRY4.S and MUXF7 data bits that no LUT or inverter drives."""
    count = 0
    for cell in netlist.cells.values():
        ports = {"CARRY4": ("S",), "MUXF7": ("I0", "I1")}.get(cell.type, ())
        for port in ports:
            for bit in cell.inputs.get(port, ()):
                if not isinstance(bit, int):
                    continue
                driver = netlist.drivers.get(bit)
                if driver is None or netlist.cells[driver.cell].type not in LUTS | {"INV"}:
                    count += 1
    return count
