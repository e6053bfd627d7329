"""The cocotb side of the board's bench: clock, reset, ears on the host's line, and a counter.

Everything at the pins is in `bench.sv`; Python hears the bytes as they come and writes them down
by itself, in ``heard.bin``, and counts the cycles from each data-ready edge at the pin to the new
results in the registers, in ``latencies.txt``.
"""

from __future__ import annotations

import os
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, Edge, FallingEdge, RisingEdge, with_timeout


async def _listen(dut, heard: bytearray) -> None:  # type: ignore[no-untyped-def]
    while True:
        await Edge(dut.byte_strobe)
        heard.append(int(dut.byte_heard.value))


async def _edges(dut, last: list[int]) -> None:  # type: ignore[no-untyped-def]
    while True:
        await RisingEdge(dut.adis_data_ready)
        last[0] = _cycle()


async def _count(dut, last: list[int], counted: list[int]) -> None:  # type: ignore[no-untyped-def]
    while True:
        await RisingEdge(dut.dut.probe_updated)
        counted.append(_cycle() - last[0])


def _cycle() -> int:
    return int(cocotb.utils.get_sim_time("ns")) // 10


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
    last, counted = [0], list[int]()
    cocotb.start_soon(_listen(dut, heard))
    cocotb.start_soon(_edges(dut, last))
    cocotb.start_soon(_count(dut, last, counted))
    await with_timeout(RisingEdge(dut.done), limit_ns, "ns")
    Path("latencies.txt").write_text(" ".join(map(str, counted)))
    Path("heard.bin").write_bytes(bytes(heard))
