"""Nothing is lost, no initiator waits for ever, and a transfer is never broken."""

import random
from collections.abc import Callable

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib.memory import Memory

from boresight.gateware.attitude.bus.arbiter import BusArbiter
from tests.support.bench import run_bench


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("busy", [0.2, 1.0])
def test_many_transfers(count: int, busy: float) -> None:
    dut, rng = BusArbiter(count=count), random.Random(count)
    seen: list[list[tuple]] = [[] for _ in range(count)]
    made: list[list[tuple]] = [[] for _ in range(count)]
    finished = []

    def initiator(k: int) -> Callable:
        async def bench(ctx):
            await transfers(ctx, k)

        return bench

    async def transfers(ctx, k: int) -> None:
        local, port = random.Random(10 + k), dut.initiators[k]
        for n in range(60):
            while local.random() >= busy:
                await ctx.tick()
            address, write = local.randrange(8) | k << 4, local.random() < 0.5
            ctx.set(port.addr, address)
            ctx.set(port.w_data, n << 4 | k)
            ctx.set(port.w_stb, write)
            ctx.set(dut.request, ctx.get(dut.request) | 1 << k)
            while True:
                _, _, grant, ack = await ctx.tick().sample(dut.grant, port.w_ack)
                assert not ack or grant >> k & 1
                if ack or (grant >> k & 1 and not write):
                    break
            ctx.set(dut.request, ctx.get(dut.request) & ~(1 << k))
            ctx.set(port.w_stb, 0)
            if write:
                made[k].append((address, n << 4 | k))
            else:  # no other initiator writes there
                assert ctx.get(port.r_data) == dict(made[k]).get(address, 0)
        finished.append(k)

    top = Module()
    willing = Signal()
    top.submodules.dut = dut
    top.submodules.words = words = Memory(shape=32, depth=4096, init=[])
    w_port = words.write_port()
    r_port = words.read_port()
    top.d.comb += [
        dut.bus.w_ack.eq(dut.bus.w_stb & willing),
        w_port.en.eq(dut.bus.w_ack),
        w_port.addr.eq(dut.bus.addr),
        w_port.data.eq(dut.bus.w_data),
        r_port.addr.eq(dut.bus.addr),
        dut.bus.r_data.eq(r_port.data),
    ]

    async def target(ctx):
        """Takes writes when it likes, reads one cycle later; who must hold still does."""
        before = None
        while True:
            ctx.set(willing, rng.random() < 0.4)
            _, _, grant, read, stb, ack, addr, data = await ctx.tick().sample(
                dut.grant, dut.read, dut.bus.w_stb, dut.bus.w_ack, dut.bus.addr, dut.bus.w_data
            )
            assert grant.bit_count() == read + stb <= 1
            if before is not None:
                assert before == (grant, addr, data) and stb
            before = (grant, addr, data) if stb and not ack else None
            if ack:
                seen[data & 15].append((addr, data))

    async def wait(ctx):
        await ctx.tick().repeat(60 * count * 40 if busy < 1 else 60 * count * 8)
        assert sorted(finished) == list(range(count))

    run_bench(top, wait, background=[*map(initiator, range(count)), target])
    assert seen == made and all(made)


def test_turns(simulate) -> None:
    """Two that always ask get every other transfer."""
    dut = BusArbiter()

    async def bench(ctx):
        grants = []
        ctx.set(dut.request, 3)
        for _ in range(20):
            _, _, grant = await ctx.tick().sample(dut.grant)
            grants.append(grant)
        assert grants in ([1, 2] * 10, [2, 1] * 10)

    simulate(dut, bench)


def test_count_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^count must be an integer from 2 on, not 1$"):
        BusArbiter(count=1)
