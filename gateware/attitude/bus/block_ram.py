"""Block RAM of the register bus."""

from __future__ import annotations

from typing import Any


def attributes(read_cycles: int) -> dict[str, Any]:
    """Attributes of the memory.

    With two cycles to read, a register is behind it, and what is read in the cycle in which it is
    written does not count: so synthesis adds no logic between the two.
    """
    return {"ram_style": "block"} | ({"no_rw_check": 1} if read_cycles == 2 else {})
