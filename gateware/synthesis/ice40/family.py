"""iCE40 UltraPlus: its cells and parts. Yosys itself uses the registers of its multipliers."""

from __future__ import annotations

from typing import Final

from boresight.gateware.synthesis.device import Device
from boresight.gateware.synthesis.family import Family, Router

#: Counts are those of nextpnr's database.
_COUNTS: Final = {
    "lut": (5280, "LUT4"),
    "ff": (5280, "flip-flop"),
    "dsp": (8, "SB_MAC16"),
    "ram": (30, "SB_RAM40_4K, block RAM of 4 Kbit"),
    "spram": (4, "SB_SPRAM256KA"),
}
_FLIP_FLOPS: Final = (
    f"SB_DFF{edge}{enable}{reset}"
    for edge in ("", "N")
    for enable in ("", "E")
    for reset in ("", "SR", "R", "SS", "S")
)

ICE40: Final = Family(
    name="ice40",
    title="Lattice iCE40 UltraPlus",
    synthesis="setattr -set no_rw_check 1 *operands*/m:*; synth_ice40 -device u -dsp",
    cells={
        "SB_LUT4": {"lut": 1},
        "SB_CARRY": {},
        **{name: {"ff": 1} for name in _FLIP_FLOPS},
        "SB_MAC16": {"dsp": 1},
        "SB_RAM40_4K": {"ram": 1},
        "SB_SPRAM256KA": {"spram": 1},
        **{name: {} for name in ("SB_IO", "SB_GB_IO", "SB_PLL40_PAD")},
    },
    flip_flop=("SB_DFF", {}, "C", "D", "Q"),
    devices=(
        Device(
            name="ice40-up5k",
            resources=_COUNTS,
            grades=(1,),
            options=("--up5k", "--package", "sg48"),
        ),
    ),
    memory_shapes={(256 << k, 16 >> k): 1 for k in range(4)},
    router=Router(
        program="nextpnr-ice40",
        extra="ice40",
        pins=("--pcf", "top.pcf"),
        placed=("--asc", "top.asc"),
        packer=("icepack",),
        bitstream="top.bin",
    ),
)
