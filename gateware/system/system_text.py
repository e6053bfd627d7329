"""What README.txt of a project says of the complete system."""

from __future__ import annotations

from typing import Protocol

from boresight.gateware.boards.ise_text import table
from boresight.gateware.core import Core
from boresight.gateware.system.plan import Plan

__all__ = ["system_text"]

_HEAD = """\
System   ADIS16385 and HMR3300 readers, calibration, {filters} filter(s), registers, output
Core     configuration {config}, {lanes} lane(s), {word}-bit words
Build    {build:016x} (registers system_build_high, system_build_low)
Host     {baud:.0f} baud, 8 data bits, no parity, 1 stop bit, 3.3 V levels
"""

_BODY = """\
The ADIS16385 takes 5 V supply and 3.3 V lines; the HMR3300 speaks with 5 V: put a divider or a
level shifter between its TX and hmr_rx. Both draw their supply from elsewhere, not from these pins.

WHAT IT DOES
After power-up it resets the ADIS16385, checks its identity, sets it up, reads it at each data-ready
edge, runs the calibration and the filter on the core, and sends every 8th attitude to the host.
  boresight monitor /dev/ttyUSB0            prints them
  boresight monitor /dev/ttyUSB0 --read temperature --map registers.json
Registers are in registers.md, .json, .svd and .h: filter, calibration, gains, sensors, counters.

{table}
Cycles are counted from the data-ready edge at the pin to the new attitude in the registers.
"""


class Described(Protocol):
    """What the text tells of a system (`gateware.system.attitude_system`)."""

    core: Core
    plan: Plan
    clock_hz: float
    host_baud: float

    @property
    def build(self) -> int:
        """Digest of programs and configuration."""

    def latency_cycles(self, number: int) -> int:
        """Data-ready at the pin to new results of a filter."""


def system_text(system: Described) -> tuple[str, str]:
    """Head and end of the README."""
    plan, machine = system.plan, system.core.machine
    head = _HEAD.format(
        filters=plan.filters,
        config=machine.name,
        lanes=machine.lanes,
        word=plan.word,
        build=system.build,
        baud=system.host_baud,
    )
    rows = [("number", "filter", "cycles", "microseconds")]
    rows += [
        (
            str(k),
            name,
            str(system.latency_cycles(k)),
            f"{1e6 * system.latency_cycles(k) / system.clock_hz:.2f}",
        )
        for k, name in enumerate(plan.names[: plan.filters])
    ]
    return head, _BODY.format(table=table(rows))
