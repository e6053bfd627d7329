"""Spartan-6: its cells and parts. No open tool routes it: its clock is an estimate (`timing`)."""

from __future__ import annotations

from typing import Final

from boresight.gateware.synthesis.device import BLOCK_18K, Device
from boresight.gateware.synthesis.family import Family
from boresight.gateware.synthesis.spartan6.timing import estimate_clock


def _device(name: str, *, slices: int, lut_ram: int, dsp: int, ram: int) -> Device:
    """A part: slices of four LUT6 and eight flip-flops each, every other one with a carry chain.

    Counts are those of Xilinx DS160, and of ISE's map reports for xc6slx9.
    """
    counts = {
        "lut": (4 * slices, "LUT6"),
        "ff": (8 * slices, "flip-flop"),
        "dsp": (dsp, "DSP48A1"),
        "ramb16": (ram, "RAMB16, block RAM of 18 Kbit"),
        "lut_ram": (lut_ram, "LUT6 used as memory or shift register"),
        "carry4": (slices // 2, "CARRY4"),
        "bufg": (16, "BUFG"),
    }
    return Device(name=name, resources=counts, grades=(2, 3), memory="ramb16")


XC6SLX9: Final = _device("xc6slx9", slices=1430, lut_ram=1440, dsp=16, ram=32)
#: LUT RAM -> LUTs that it takes.
_LUT_RAMS: Final = {
    **dict.fromkeys(("RAM16X1S", "RAM32X1S", "RAM64X1S"), 1),
    **dict.fromkeys(("RAM128X1S", "RAM16X1D", "RAM32X1D", "RAM64X1D"), 2),
    **dict.fromkeys(("RAM256X1S", "RAM128X1D", "RAM32M", "RAM64M"), 4),
}
#: Cells that a netlist may have: no latches, and no flip-flops on the falling edge of the clock.
_CELLS: Final[dict[str, dict[str, float]]] = {
    **{f"LUT{inputs}": {"lut": 1} for inputs in ("1", "2", "3", "4", "5", "6", "6_2")},
    "INV": {"lut": 1},  # one that is left feeds no LUT: it takes one
    **{name: {"lut": 1, "lut_ram": 1} for name in ("SRL16E", "SRLC16E", "SRLC32E")},
    **{name: {"lut": luts, "lut_ram": luts} for name, luts in _LUT_RAMS.items()},
    **{name: {"ff": 1} for name in ("FDRE", "FDSE", "FDCE", "FDPE")},
    **{name: {} for name in ("MUXF7", "MUXF8", "GND", "VCC")},
    "CARRY4": {"carry4": 1},
    "DSP48A1": {"dsp": 1},
    "RAMB16BWER": {"ramb16": 1},
    "RAMB8BWER": {"ramb16": 0.5},
    "BUFG": {"bufg": 1},
}

SPARTAN6: Final = Family(
    name="spartan6",
    title="Xilinx Spartan-6",
    synthesis="synth_xilinx -family xc6s -flatten -noiopad",
    cells=_CELLS,
    # Small first.
    devices=(
        _device("xc6slx4", slices=600, lut_ram=1200, dsp=8, ram=12),
        XC6SLX9,
        _device("xc6slx16", slices=2278, lut_ram=2176, dsp=32, ram=32),
        _device("xc6slx25", slices=3758, lut_ram=3664, dsp=38, ram=52),
        _device("xc6slx45", slices=6822, lut_ram=6408, dsp=58, ram=116),
    ),
    # RAMB16 and its halves.
    memory_shapes=BLOCK_18K | {(words // 2, bits): 0.5 for words, bits in BLOCK_18K},
    estimate=estimate_clock,
)
