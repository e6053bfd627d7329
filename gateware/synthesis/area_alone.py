"""Families that no router of PyPI has: a core has an area, by yosys alone, and no clock.

Counts are those of the overviews of Artix-7 (Xilinx DS180) and Cyclone V E (Intel CV-51001).
"""

from __future__ import annotations

from typing import Final

from boresight.gateware.synthesis.device import BLOCK_18K, Device
from boresight.gateware.synthesis.family import NO_RW_CHECK, Family


def _artix7(size: str, lut: int, dsp: int, ram: int) -> Device:
    counts = {"lut": (lut, "LUT6"), "ff": (2 * lut, "flip-flop"), "dsp": (dsp, "DSP48E1")}
    counts |= {"ram": (ram, "RAMB36E1, block RAM of 36 Kbit")}
    return Device(name=f"artix7-{size}", resources=counts, grades=(1,))


ARTIX7: Final = Family(
    name="artix7",
    title="Xilinx Artix-7",
    synthesis=NO_RW_CHECK + "synth_xilinx -family xc7 -flatten -noiopad -noclkbuf",
    cells={
        **{f"LUT{inputs}": {"lut": 1} for inputs in range(1, 7)},
        **{name: {"lut": 1} for name in ("INV", "SRL16E", "SRLC32E")},
        **{name: {"lut": 2} for name in ("RAM32X1D", "RAM64X1D")},
        **{name: {"lut": 4} for name in ("RAM32M", "RAM64M", "RAM128X1D")},
        **{name: {} for name in ("CARRY4", "MUXF7", "MUXF8")},
        **{name: {"ff": 1} for name in ("FDRE", "FDSE", "FDCE", "FDPE")},
        "DSP48E1": {"dsp": 1},
        "RAMB18E1": {"ram": 0.5},
        "RAMB36E1": {"ram": 1},
    },
    devices=(
        _artix7("12t", 8000, 40, 20),
        _artix7("15t", 10400, 45, 25),
        _artix7("25t", 14600, 80, 45),
        _artix7("35t", 20800, 90, 50),
        _artix7("50t", 32600, 120, 75),
        _artix7("75t", 47200, 180, 105),
        _artix7("100t", 63400, 240, 135),
        _artix7("200t", 134600, 740, 365),
    ),
    memory_shapes=dict.fromkeys(BLOCK_18K, 0.5),
)


def _cyclone5(size: str, alm: int, dsp: int, ram: int) -> Device:
    counts = {"lut": (alm, "ALM"), "ff": (4 * alm, "flip-flop")}
    counts |= {"dsp": (dsp, "variable-precision DSP block"), "ram": (ram, "M10K")}
    return Device(name=f"cyclone5-{size}", resources=counts, grades=(8,))


#: Two tables of up to 5 inputs fit into an ALM, as far as they share inputs; one of 6. A DSP block
#: has three multipliers of 9 bits, two of 18 or one of 27.
CYCLONE5: Final = Family(
    name="cyclone5",
    title="Intel Cyclone V",
    synthesis=NO_RW_CHECK + "synth_intel_alm -noiopad -noclkbuf -nolutram",
    cells={
        **{f"MISTRAL_ALUT{inputs}": {"lut": 0.5} for inputs in range(2, 6)},
        **{name: {"lut": 0.5} for name in ("MISTRAL_NOT", "MISTRAL_ALUT_ARITH")},
        "MISTRAL_ALUT6": {"lut": 1},
        "MISTRAL_FF": {"ff": 1},
        "MISTRAL_MUL9X9": {"dsp": 1 / 3},
        "MISTRAL_MUL18X18": {"dsp": 0.5},
        "MISTRAL_MUL27X27": {"dsp": 1},
        "MISTRAL_M10K": {"ram": 1},
    },
    devices=(
        _cyclone5("a2", 9430, 25, 176),
        _cyclone5("a4", 18480, 66, 308),
        _cyclone5("a5", 29080, 150, 446),
        _cyclone5("a7", 56480, 156, 686),
        _cyclone5("a9", 113560, 342, 1220),
    ),
    memory_shapes={(256 << k, bits): 1 for k, bits in enumerate((40, 20, 10, 5, 2, 1))},
)
