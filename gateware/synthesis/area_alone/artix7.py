"""Artix-7: cells and parts. No router on PyPI has them: a core has an area and no clock."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from boresight.gateware.synthesis.device import Device, resources
from boresight.gateware.synthesis.family import NO_RW_CHECK, Family

__all__ = ["ARTIX7"]

_SOURCE: Final = "Xilinx DS180, 7 Series FPGAs Data Sheet: Overview"


def _device(size: str, lut: int, dsp: int, ram: int) -> Device:
    counts = {"lut": (lut, "LUT6"), "ff": (2 * lut, "flip-flop"), "dsp": (dsp, "DSP48E1")}
    counts |= {"ram": (ram, "RAMB36E1, block RAM of 36 Kbit")}
    return Device(
        name=f"artix7-{size}",
        resources=resources(_SOURCE, **counts),
        grades=(1,),
        package_source=_SOURCE,
    )


ARTIX7: Final = Family(
    name="artix7",
    title="Xilinx Artix-7",
    synthesis=NO_RW_CHECK + "synth_xilinx -family xc7 -flatten -noiopad -noclkbuf",
    cells=MappingProxyType(
        {
            **{f"LUT{inputs}": {"lut": 1} for inputs in range(1, 7)},
            **{name: {"lut": 1} for name in ("INV", "SRL16E", "SRLC32E")},
            **{name: {"lut": 2} for name in ("RAM32X1D", "RAM64X1D")},
            **{name: {"lut": 4} for name in ("RAM32M", "RAM64M", "RAM128X1D")},
            **{name: {} for name in ("CARRY4", "MUXF7", "MUXF8")},
            **{name: {"ff": 1} for name in ("FDRE", "FDSE", "FDCE", "FDPE")},
            "DSP48E1": {"dsp": 1},
            "RAMB18E1": {"ram": 0.5},
            "RAMB36E1": {"ram": 1},
        }
    ),
    devices=(
        _device("12t", 8000, 40, 20),
        _device("15t", 10400, 45, 25),
        _device("25t", 14600, 80, 45),
        _device("35t", 20800, 90, 50),
        _device("50t", 32600, 120, 75),
        _device("75t", 47200, 180, 105),
        _device("100t", 63400, 240, 135),
        _device("200t", 134600, 740, 365),
    ),
    memory_shapes=MappingProxyType(
        {(512 << k, bits): 0.5 for k, bits in enumerate((36, 18, 9, 4, 2, 1))}
    ),
)
