"""Shared by the gateware tests: simulation of a component, proof of its primitives."""

import os
import subprocess
from collections.abc import Callable

import pytest
from amaranth.hdl import ClockDomain, Module
from amaranth.lib import wiring

from boresight.gateware.synthesis.tools import find_tool, to_verilog
from boresight.model.tools.external import yosys_environment
from tests.support.bench import run_bench
from tests.support.clock import pause

SCRIPT = """
read_verilog +/xilinx/cells_sim.v gold.v
prep -flatten -top gold
design -stash gold
read_verilog +/xilinx/cells_sim.v gate.v
prep -flatten -top gate
design -stash gate
design -copy-from gold -as gold gold
design -copy-from gate -as gate gate
async2sync
dffunmap
miter -equiv -flatten -make_assert gold gate miter
hierarchy -top miter
opt -full
opt_merge -share_all
opt -full
select -assert-max {multipliers} t:$mul
cutpoint t:$mul
sat -verify -prove-asserts -tempinduct -enable_undef -set-def-inputs -maxsteps 8 miter
"""


@pytest.fixture
def simulate() -> Callable:
    """Run a testbench on a component, others in the background."""

    def run(dut: wiring.Component, bench: Callable, *background: Callable) -> None:
        top = Module()
        top.domains.sync = ClockDomain()  # also for what has no register
        top.submodules.dut = dut
        run_bench(top, bench, background=background)

    return run


@pytest.fixture
def proves_equal(tmp_path) -> Callable:
    """Prove by induction that a component with primitives equals its behaviour.

    The primitives mean what the models of the synthesis tool's library say. Multipliers must have
    become common to both sides (at most ``multipliers`` are left); their outputs are then free.
    """

    def prove(gold: wiring.Component, gate: wiring.Component, multipliers: int = 0) -> bool:
        (tmp_path / "gold.v").write_text(to_verilog(gold, "gold", instances=False))
        (tmp_path / "gate.v").write_text(to_verilog(gate, "gate", instances=True))
        (tmp_path / "prove.ys").write_text(SCRIPT.format(multipliers=multipliers))
        done = subprocess.run(
            [*find_tool().argv, "-q", "-s", "prove.ys"],
            cwd=tmp_path,
            env={**os.environ, **yosys_environment()},
            capture_output=True,
            text=True,
        )
        assert not done.returncode or "proof did fail" in done.stderr, done.stderr
        return not done.returncode

    return prove


@pytest.fixture
def send() -> Callable:
    """Put bytes, or anything that is no byte, on a line."""

    async def put(ctx, line, divisor: int, data: bytes, stop: int = 1) -> None:
        for byte in data:
            for bit in (0, *(byte >> k & 1 for k in range(8)), stop):
                ctx.set(line, bit)
                await pause(ctx, divisor)
        ctx.set(line, 1)

    return put


@pytest.fixture
def listen() -> Callable:
    """A background testbench that appends the bytes of a line to ``received``."""

    def make(line, divisor: int, received: bytearray) -> Callable:
        async def bench(ctx):
            while True:
                if ctx.get(line):
                    await ctx.negedge(line)
                await pause(ctx, divisor // 2)
                assert not ctx.get(line), "a start bit that is none"
                byte = 0
                for bit in range(8):
                    await pause(ctx, divisor)
                    byte |= ctx.get(line) << bit
                await pause(ctx, divisor)
                assert ctx.get(line), "no stop bit"
                received.append(byte)

        return bench

    return make
