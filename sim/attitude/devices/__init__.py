"""Models of the sensors at their pins, in SystemVerilog, with a switch for every fault.

``adis16385.sv`` is the inertial sensor, ``hmr3300.sv`` the compass.
"""

from __future__ import annotations

from pathlib import Path

#: Faults of the inertial sensor's model, by their bits.
INERTIAL_FAULTS = (
    *("wrong_identity", "absent", "stuck_low", "stuck_high", "no_data_ready", "fast_data_ready"),
    *("alarm", "over_range", "reset", "ignore_writes", "bit_flips", "lost_settings"),
    "link_failure",
)
#: Faults of the compass's model, by their bits.
COMPASS_FAULTS = (
    *("silence", "garbage", "framing", "glitches", "wrong_baud", "truncated", "missing_field"),
    *("out_of_range", "stuck_low", "stuck_high", "ignores_commands", "reset"),
)


def device_text(name: str) -> str:
    """SystemVerilog of a model: module ``adis16385_device`` or ``hmr3300_device``."""
    return Path(__file__).with_name(f"{name}.sv").read_text()
