"""The compass's model: its text and its faults."""

from __future__ import annotations

from pathlib import Path
from typing import Final

__all__ = ["FAULTS", "device_text"]

#: Faults of the device model, by their bits.
FAULTS: Final = (
    "silence",
    "garbage",
    "framing",
    "glitches",
    "wrong_baud",
    "truncated",
    "missing_field",
    "out_of_range",
    "stuck_low",
    "stuck_high",
    "ignores_commands",
    "reset",
)


def device_text() -> str:
    """SystemVerilog of the device model, module ``hmr3300_device``."""
    return Path(__file__).with_name("hmr3300.sv").read_text()
