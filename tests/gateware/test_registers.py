"""The register bus by itself: flags against events in the same cycle."""

import pytest

from gateware.machine import CONFIGS
from gateware.registers import Registers


def make(digest: int = 0) -> Registers:
    return Registers(machine=CONFIGS["small"], digest=digest)


@pytest.mark.parametrize("event, bit", [("saturated", 0), ("framing", 1)])
def test_an_event_beats_its_clearing(event: str, bit: int, simulate) -> None:
    dut = make()

    async def bench(ctx):
        ctx.set(dut.bus.addr, 512)
        ctx.set(dut.bus.w_data, 3)
        ctx.set(dut.bus.w_stb, 1)
        ctx.set(getattr(dut, event), 1)
        await ctx.tick()
        ctx.set(getattr(dut, event), 0)
        ctx.set(dut.bus.w_stb, 0)
        await ctx.tick()
        assert ctx.get(dut.bus.r_data) == 1 << bit
        ctx.set(dut.bus.w_stb, 1)
        await ctx.tick()
        ctx.set(dut.bus.w_stb, 0)
        await ctx.tick()
        assert ctx.get(dut.bus.r_data) == 0

    simulate(dut, bench)


def test_saturated_update_tells_of_the_last_update(simulate) -> None:
    dut = make()

    async def update(ctx, *events: str) -> int:
        for event in events:
            ctx.set(getattr(dut, event), 1)
            await ctx.tick()
            ctx.set(getattr(dut, event), 0)
        ctx.set(dut.commit, 1)
        await ctx.tick()
        ctx.set(dut.commit, 0)
        return ctx.get(dut.saturated_update)

    async def bench(ctx):
        assert await update(ctx) == 0
        assert await update(ctx, "saturated") == 1
        await ctx.tick().repeat(3)
        assert ctx.get(dut.saturated_update) == 1
        # What saturated before the fault belongs to no update.
        assert await update(ctx, "saturated", "framing") == 0
        assert await update(ctx) == 0
        ctx.set(dut.saturated, 1)
        assert await update(ctx) == 1

    simulate(dut, bench)


@pytest.mark.parametrize("address, waits", [(0, True), (255, True), (256, False), (511, False),
                                            (512, False), (1023, False)])
def test_only_parameters_wait(address: int, waits: bool, simulate) -> None:
    dut = make()

    async def bench(ctx):
        ctx.set(dut.bus.addr, address)
        assert not ctx.get(dut.request) and not ctx.get(dut.bus.w_ack)
        ctx.set(dut.bus.w_stb, 1)
        assert ctx.get(dut.request) == waits
        assert ctx.get(dut.bus.w_ack) != waits
        ctx.set(dut.grant, 1)
        assert ctx.get(dut.bus.w_ack)

    simulate(dut, bench)


def test_digest_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^digest must not be negative, not -5$"):
        make(digest=-5)
