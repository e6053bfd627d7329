"""The processor's reset and connections."""

from __future__ import annotations

import re

from amaranth.hdl import Const

from boresight.gateware.soc.cpu import RESET_VECTOR, Cpu, cpu_verilog


def test_reset_after_power_up_and_on_demand(processor, simulate) -> None:
    """Seven cycles: some of its registers need several to leave an unknown state."""
    dut = Cpu()

    async def bench(ctx):
        reset = processor["i_reset"]
        held = 0
        while ctx.get(reset):
            held += 1
            await ctx.tick()
        assert held == 7
        for _ in range(40):
            assert not ctx.get(reset)
            await ctx.tick()
        ctx.set(dut.restart, 1)
        assert ctx.get(reset)
        await ctx.tick().repeat(3)
        ctx.set(dut.restart, 0)
        assert not ctx.get(reset)

    simulate(dut, bench)


def test_every_port_of_the_processor_is_connected(processor, simulate) -> None:
    """Name and width as in the package's Verilog, but for what its debugger and burst logic say."""

    async def bench(ctx):
        ports = {
            name: (way, int(high or 0) + 1)
            for way, high, name in re.findall(
                r"(?m)^\s*(input|output)\s+(?:wire|reg)?\s*(?:\[(\d+):0\])?\s*(\w+)[,)\s]*$",
                re.search(r"(?s)module VexRiscv \((.*?)\);", cpu_verilog())[1],
            )
        }
        found = {
            name.split("_", 1)[1]: ({"i": "input", "o": "output"}[name[0]], len(value))
            for name, value in processor.items()
            if name != "i_clk"
        }
        unused = set(ports) - set(found) - {"clk"}
        assert unused <= {"iBusWishbone_BTE", "dBusWishbone_BTE"}
        assert found == {name: ports[name] for name in found}

    simulate(Cpu(), bench)


def test_what_never_happens_is_tied_low(processor, simulate) -> None:
    async def bench(ctx):
        constants = {n: v.value for n, v in processor.items() if isinstance(v, Const)}
        assert constants == {
            "i_externalResetVector": RESET_VECTOR,
            "i_softwareInterrupt": 0,
            "i_iBusWishbone_ERR": 0,
            "i_dBusWishbone_ERR": 0,
        }

    simulate(Cpu(), bench)
