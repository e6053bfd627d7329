"""A part of an FPGA family, as data; the parts are in the modules of their families."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

#: Words and bits that a block RAM of 18 Kbit can have.
BLOCK_18K: Final = {(512 << k, bits): 1.0 for k, bits in enumerate((36, 18, 9, 4, 2, 1))}


@dataclass(frozen=True, kw_only=True)
class Device:
    """One FPGA part.

    Attributes
    ----------
    name : str
        Part name without grade or package, lower case.
    resources : mapping
        How many of a primitive are on the die, and its name in texts. Keys are ``lut``, ``ff``,
        ``dsp``, that of ``memory``, and more of the family's own.
    grades : tuple of int
        Speed grades with delays, slow first.
    memory : str
        Key of the block RAM.
    options : tuple of str
        Options of the family's router for the part and a package, ``{grade}`` in place of the speed
        grade.
    """

    name: str
    resources: Mapping[str, tuple[int, str]]
    grades: tuple[int, ...]
    memory: str = "ram"
    options: tuple[str, ...] = ()

    def capacity(self, key: str) -> int:
        """Return how many of the resource ``key`` the part holds."""
        return self.resources[key][0]

    def unit(self, key: str) -> str:
        """Return the name of the resource ``key``."""
        return self.resources[key][1]

    def percent(self, key: str, used: float) -> float:
        """Return ``used`` as a percentage of the resource ``key``, 0.01 steps."""
        return round(100.0 * used / self.capacity(key), 2)
