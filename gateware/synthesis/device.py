"""The Spartan-6 part this toolkit targets, as data.

Capacities are counts of primitives on the die; the package decides only the pins. Every figure
carries the place it was read from, so that a report can repeat it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, kw_only=True)
class Resource:
    """How many of one primitive the part holds.

    Attributes
    ----------
    count : int
        Number on the die, >= 1.
    unit : str
        What is counted, in words.
    source : str
        Where the number was read.
    """

    count: int
    unit: str
    source: str


@dataclass(frozen=True, kw_only=True)
class Device:
    """One FPGA part.

    Attributes
    ----------
    name : str
        Part name without grade or package, lower case.
    resources : mapping
        Keys ``lut``, ``lut_ram``, ``ff``, ``carry4``, ``dsp``, ``ramb16``, ``bufg``.
    packages : mapping
        Package name -> user I/O pins, None where no source gave the number.
    grades : tuple of int
        Speed grades for which this toolkit holds delays (2 is slower than 3).
    package_source : str
        Where packages and grades were read.
    """

    name: str
    resources: Mapping[str, Resource]
    packages: Mapping[str, int | None]
    grades: tuple[int, ...]
    package_source: str

    def capacity(self, key: str) -> int:
        """Return how many of the resource ``key`` the part holds."""
        if key not in self.resources:
            names = ", ".join(sorted(self.resources))
            raise ValueError(f"resource must be one of {names}, not {key!r}")
        return self.resources[key].count

    def percent(self, key: str, used: float) -> float:
        """Return ``used`` as a percentage of the resource ``key``, 0.01 steps."""
        return round(100.0 * used / self.capacity(key), 2)

    def ise_part(self, *, package: str, grade: int) -> str:
        """Return the part name as the ISE tools take it, e.g. ``xc6slx9-2-tqg144``."""
        if package not in self.packages:
            names = ", ".join(sorted(self.packages))
            raise ValueError(f"package must be one of {names}, not {package!r}")
        if grade not in self.grades:
            names = ", ".join(str(g) for g in self.grades)
            raise ValueError(f"grade must be one of {names}, not {grade!r}")
        return f"{self.name}-{grade}-{package}"


_MAP = "device utilisation tables of ISE 14.x map reports published for xc6slx9 designs"


def _count(count: int, unit: str, source: str = _MAP) -> Resource:
    return Resource(count=count, unit=unit, source=source)


#: Spartan-6 LX9: 1,430 slices of four LUT6 and eight flip-flops each.
XC6SLX9 = Device(
    name="xc6slx9",
    resources=MappingProxyType(
        {
            "lut": _count(5720, "six-input LUT"),
            "lut_ram": _count(1440, "LUT that can be distributed RAM or shift register"),
            "ff": _count(11440, "slice flip-flop"),
            "carry4": _count(715, "four-bit carry chain", _MAP + "; 2,860 MUXCY, four per slice"),
            "dsp": _count(16, "DSP48A1"),
            "ramb16": _count(32, "18 Kbit block RAM", _MAP + "; each splits into two RAMB8"),
            "bufg": _count(16, "global clock buffer"),
        }
    ),
    packages=MappingProxyType(
        {"cpg196": None, "tqg144": 102, "csg225": None, "csg324": 200, "ftg256": None}
    ),
    grades=(2, 3),
    package_source=(
        "package and grade list of the prjcombine Spartan-6 database; pin counts from "
        "ISE map reports (the die has 200 I/O blocks, all bonded in csg324)"
    ),
)
