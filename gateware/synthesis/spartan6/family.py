"""Spartan-6 among the families: area and clock come from `gateware.synthesis.estimate`."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from boresight.gateware.synthesis.family import Family
from boresight.gateware.synthesis.spartan6.device import DEVICES
from boresight.gateware.synthesis.yosys import SPARTAN6 as COMMAND

__all__ = ["SPARTAN6"]

SPARTAN6: Final = Family(
    name="spartan6",
    title="Xilinx Spartan-6",
    synthesis=COMMAND,
    cells={},
    devices=DEVICES,
    # RAMB16 and its halves.
    memory_shapes=MappingProxyType(
        {(512 << k, bits): 1 for k, bits in enumerate((36, 18, 9, 4, 2, 1))}
        | {(256 << k, bits): 0.5 for k, bits in enumerate((36, 18, 9, 4, 2, 1))}
    ),
)
