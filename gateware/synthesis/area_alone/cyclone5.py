"""Cyclone V: cells and parts. No router on PyPI has them: a core has an area and no clock."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from boresight.gateware.synthesis.device import Device, resources
from boresight.gateware.synthesis.family import NO_RW_CHECK, Family

__all__ = ["CYCLONE5"]

_SOURCE: Final = "Intel CV-51001, Cyclone V Device Overview: Cyclone V E"


def _device(size: str, alm: int, dsp: int, ram: int) -> Device:
    counts = {"lut": (alm, "ALM"), "ff": (4 * alm, "flip-flop")}
    counts |= {"dsp": (dsp, "variable-precision DSP block"), "ram": (ram, "M10K")}
    return Device(
        name=f"cyclone5-{size}",
        resources=resources(_SOURCE, **counts),
        grades=(8,),
        package_source=_SOURCE,
    )


#: Two tables of up to 5 inputs fit into an ALM, as far as they share inputs; one of 6. A DSP block
#: has three multipliers of 9 bits, two of 18 or one of 27.
CYCLONE5: Final = Family(
    name="cyclone5",
    title="Intel Cyclone V",
    synthesis=NO_RW_CHECK + "synth_intel_alm -noiopad -noclkbuf -nolutram",
    cells=MappingProxyType(
        {
            **{f"MISTRAL_ALUT{inputs}": {"lut": 0.5} for inputs in range(2, 6)},
            **{name: {"lut": 0.5} for name in ("MISTRAL_NOT", "MISTRAL_ALUT_ARITH")},
            "MISTRAL_ALUT6": {"lut": 1},
            "MISTRAL_FF": {"ff": 1},
            "MISTRAL_MUL9X9": {"dsp": 1 / 3},
            "MISTRAL_MUL18X18": {"dsp": 0.5},
            "MISTRAL_MUL27X27": {"dsp": 1},
            "MISTRAL_M10K": {"ram": 1},
        }
    ),
    devices=(
        _device("a2", 9430, 25, 176),
        _device("a4", 18480, 66, 308),
        _device("a5", 29080, 150, 446),
        _device("a7", 56480, 156, 686),
        _device("a9", 113560, 342, 1220),
    ),
    memory_shapes=MappingProxyType(
        {(256 << k, bits): 1 for k, bits in enumerate((40, 20, 10, 5, 2, 1))}
    ),
)
