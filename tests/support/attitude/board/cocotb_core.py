"""The cocotb side of a core alone: records in without a pause, words out, and a counter."""

from __future__ import annotations

import json
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def core(dut) -> None:  # type: ignore[no-untyped-def]
    """Each output word, and the cycles from the first input word taken to it, both counted."""
    Clock(dut.clk, 10, unit="ns", impl="gpi").start()
    for port in (dut.i__valid, dut.i__payload, dut.bus__w_stb, dut.bus__addr, dut.restart):
        port.value = 0
    dut.rst.value = dut.o__ready.value = 1
    await ClockCycles(dut.clk, 4)
    await FallingEdge(dut.clk)
    dut.rst.value = 0
    last, found = 1 << len(dut.i__payload) - 1, []
    for record in json.loads(Path("records.txt").read_text()):
        outputs: list[tuple[int, int]] = []
        left, cycle = [*record[:-1], record[-1] | last], 0
        while not outputs or not outputs[-1][0] & last:
            await FallingEdge(dut.clk)
            dut.i__valid.value, dut.i__payload.value = bool(left), (*left, 0)[0]
            await RisingEdge(dut.clk)
            taken = left and dut.i__ready.value == 1
            cycle += bool(cycle or taken)
            left = left[1:] if taken else left
            if dut.o__valid.value == 1:
                outputs.append((int(dut.o__payload.value), cycle))
        found.append([(word & last - 1, cycle) for word, cycle in outputs])
    Path("found.txt").write_text(json.dumps(found))
