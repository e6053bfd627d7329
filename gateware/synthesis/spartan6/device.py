"""The Spartan-6 parts, as data."""

from types import MappingProxyType
from typing import Final

from boresight.gateware.synthesis.device import Device, Resource

_MAP = "device utilisation tables of ISE 14.x map reports published for xc6slx9 designs"
_OVERVIEW = "Xilinx DS160, Spartan-6 family overview"


def _device(
    name: str,
    *,
    slices: int,
    lut_ram: int,
    dsp: int,
    ram: int,
    source: str = _OVERVIEW,
    packages: dict[str, int | None] | None = None,
    package_source: str = _OVERVIEW,
) -> Device:
    """A part: slices of four LUT6 and eight flip-flops each, every other one with a carry chain."""

    def count(count: int, unit: str, note: str = "") -> Resource:
        return Resource(count=count, unit=unit, source=source + note)

    return Device(
        name=name,
        resources=MappingProxyType(
            {
                "lut": count(4 * slices, "six-input LUT"),
                "lut_ram": count(lut_ram, "LUT that can be distributed RAM or shift register"),
                "ff": count(8 * slices, "slice flip-flop"),
                "carry4": count(
                    slices // 2, "four-bit carry chain", f"; {2 * slices:,} MUXCY, four per slice"
                ),
                "dsp": count(dsp, "DSP48A1"),
                "ramb16": count(ram, "18 Kbit block RAM", "; each splits into two RAMB8"),
                "bufg": count(16, "global clock buffer"),
            }
        ),
        packages=MappingProxyType(packages or {}),
        grades=(2, 3),
        package_source=package_source,
        memory="ramb16",
    )


XC6SLX9: Final = _device(
    "xc6slx9",
    slices=1430,
    lut_ram=1440,
    dsp=16,
    ram=32,
    source=_MAP,
    packages={"cpg196": None, "tqg144": 102, "csg225": None, "csg324": 200, "ftg256": None},
    package_source=(
        "package and grade list of the prjcombine Spartan-6 database; pin counts from "
        "ISE map reports (the die has 200 I/O blocks, all bonded in csg324)"
    ),
)
#: Small first.
DEVICES: Final = (
    _device("xc6slx4", slices=600, lut_ram=1200, dsp=8, ram=12),
    XC6SLX9,
    _device("xc6slx16", slices=2278, lut_ram=2176, dsp=32, ram=32),
    _device("xc6slx25", slices=3758, lut_ram=3664, dsp=38, ram=52),
    _device("xc6slx45", slices=6822, lut_ram=6408, dsp=58, ram=116),
)
