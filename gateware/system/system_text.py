"""What README.txt of a project says of the complete system."""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.boards.ise_text import table
from boresight.gateware.machine import Machine
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


def system_text(
    plan: Plan,
    machine: Machine,
    *,
    build: int,
    baud: float,
    clock_hz: float,
    latency_cycles: Sequence[int],
) -> tuple[str, str]:
    """Head and end of the README, with the latency of each filter from data-ready to registers."""
    head = _HEAD.format(
        filters=plan.filters,
        config=machine.name,
        lanes=machine.lanes,
        word=plan.word,
        build=build,
        baud=baud,
    )
    rows = [("number", "filter", "cycles", "microseconds")]
    rows += [
        (str(k), name, str(cycles), f"{1e6 * cycles / clock_hz:.2f}")
        for k, (name, cycles) in enumerate(zip(plan.names, latency_cycles, strict=False))
    ]
    return head, _BODY.format(table=table(rows))
