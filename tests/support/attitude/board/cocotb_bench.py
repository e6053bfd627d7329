"""The cocotb side of the board's bench: clock, reset, and ears on the host's line.

Everything at the pins is in `bench.sv`; Python hears the bytes as they come and writes them down
by itself, in ``heard.bin``.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, Edge, FallingEdge, RisingEdge, with_timeout


async def _listen(dut, heard: bytearray) -> None:  # type: ignore[no-untyped-def]
    while True:
        await Edge(dut.byte_strobe)
        heard.append(int(dut.byte_heard.value))


@cocotb.test()
async def board(dut) -> None:  # type: ignore[no-untyped-def]
    """Reset, run until the bench says it is done, fail when that takes too long."""
    limit_ns = 10 * int(os.environ["BOARD_MAX_CYCLES"])
    heard = bytearray()
    # The simulator's own clock driver: Python is called for bytes alone.
    clock = Clock(dut.clk, 10, unit="ns", impl="gpi")
    clock.start()
    dut.rst.value = 1
    await ClockCycles(dut.clk, 4)
    await FallingEdge(dut.clk)
    dut.rst.value = 0
    cocotb.start_soon(_listen(dut, heard))
    start = time.perf_counter()
    await with_timeout(RisingEdge(dut.done), limit_ns, "ns")
    seconds = time.perf_counter() - start
    cycles = int(cocotb.utils.get_sim_time("ns")) // 10
    Path("heard.bin").write_bytes(bytes(heard))
    Path("speed.txt").write_text(f"{cycles} {seconds}\n")
