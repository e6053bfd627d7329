"""The cocotb side of the replay: clock, reset, and waiting for the end.

The stimulus itself is fed and recorded by `replay.sv`, so that a long log runs at the simulator's
own speed and not at Python's.
"""

from __future__ import annotations

import os

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, with_timeout


@cocotb.test()
async def replay(dut) -> None:  # type: ignore[no-untyped-def]
    """Reset, run until the harness says it is done, fail when that takes too long."""
    limit_ns = 10 * int(os.environ["REPLAY_MAX_CYCLES"])
    Clock(dut.clk, 10, unit="ns").start()
    dut.rst.value = 1
    await ClockCycles(dut.clk, 4)
    await FallingEdge(dut.clk)
    dut.rst.value = 0
    await with_timeout(RisingEdge(dut.done), limit_ns, "ns")
