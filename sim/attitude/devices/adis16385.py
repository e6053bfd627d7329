"""The inertial sensor's model: its text and its faults."""

from __future__ import annotations

from pathlib import Path
from typing import Final

__all__ = ["FAULTS", "device_text"]

#: Faults of the device model, by their bits.
FAULTS: Final = (
    "wrong_identity",
    "absent",
    "stuck_low",
    "stuck_high",
    "no_data_ready",
    "fast_data_ready",
    "alarm",
    "over_range",
    "reset",
    "ignore_writes",
    "bit_flips",
    "lost_settings",
    "link_failure",
)


def device_text() -> str:
    """SystemVerilog of the device model, module ``adis16385_device``."""
    return Path(__file__).with_name("adis16385.sv").read_text()
