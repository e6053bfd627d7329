"""A part of an FPGA family, as data.

Capacities are counts of primitives on the die; the package decides only the pins. Every figure
carries the place it was read from, so that a report can repeat it. The parts themselves stand in
the folders of their families.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType


@dataclass(frozen=True, kw_only=True)
class Resource:
    """How many of one primitive the part holds.

    Attributes
    ----------
    count : int
        Number on the die, >= 1.
    unit : str
        Name of the resource, in words.
    source : str
        Where the number was read.
    """

    count: int
    unit: str
    source: str


def resources(source: str, **counts: tuple[int, str]) -> Mapping[str, Resource]:
    """Resources of a part by key, from (count, unit), all read in one place."""
    return MappingProxyType(
        {key: Resource(count=n, unit=unit, source=source) for key, (n, unit) in counts.items()}
    )


@dataclass(frozen=True, kw_only=True)
class Device:
    """One FPGA part.

    Attributes
    ----------
    name : str
        Part name without grade or package, lower case.
    resources : mapping
        Keys ``lut``, ``ff``, ``dsp``, that of ``memory``, and more of the family's own.
    packages : mapping
        Package name -> user I/O pins, None where no source gave the number.
    grades : tuple of int
        Speed grades with delays, slow first.
    package_source : str
        Where packages and grades were read.
    memory : str
        Key of the block RAM.
    options : tuple of str
        Options of the family's router for the part and its first package, ``{grade}`` in place of
        the speed grade.
    """

    name: str
    resources: Mapping[str, Resource]
    packages: Mapping[str, int | None] = field(default_factory=lambda: MappingProxyType({}))
    grades: tuple[int, ...]
    package_source: str
    memory: str = "ram"
    options: tuple[str, ...] = ()

    def capacity(self, key: str) -> int:
        """Return how many of the resource ``key`` the part holds."""
        if key not in self.resources:
            names = ", ".join(sorted(self.resources))
            raise ValueError(f"resource must be one of {names}, not {key!r}")
        return self.resources[key].count

    def percent(self, key: str, used: float) -> float:
        """Return ``used`` as a percentage of the resource ``key``, 0.01 steps."""
        return round(100.0 * used / self.capacity(key), 2)
