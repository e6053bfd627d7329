"""Input registers: a set goes as a whole, whatever is written meanwhile."""

import random

import pytest
from amaranth.sim import Simulator

from boresight.gateware.bus.feed_registers import FeedRegisters


@pytest.mark.parametrize("count", [1, 2, 7, 32])
def test_sets_are_whole(count: int) -> None:
    dut = FeedRegisters(word=32, init=range(100, 100 + count))
    rng = random.Random(count)
    live = [-1] * count  # what the conductor has
    sets: list[list[int]] = []
    wanted = list(range(100, 100 + count))

    async def conductor(ctx):
        while True:
            ctx.set(dut.free, rng.random() < 0.3)
            ctx.set(dut.ready, rng.random() < 0.7)
            _, _, valid, ready, index, data, done = await ctx.tick().sample(
                dut.valid, dut.ready, dut.index, dut.data, dut.done
            )
            if valid and ready:
                live[index] = data
            assert not done or (valid and ready and index == count - 1)
            if done:
                sets.append(list(live))

    async def host(ctx):
        for turn in range(12):
            for _ in range(rng.randrange(3) + (turn > 0)):
                k, word = rng.randrange(count), rng.getrandbits(32)
                ctx.set(dut.w_index, k)
                ctx.set(dut.w_data, word)
                ctx.set(dut.w_en, 1)
                busy = 1
                while busy:  # the bus waits
                    _, _, busy = await ctx.tick().sample(dut.busy)
                ctx.set(dut.w_en, 0)
                wanted[k] = word
            ctx.set(dut.take, 1)
            await ctx.tick()
            ctx.set(dut.take, 0)
            expected = list(wanted)
            if rng.random() < 0.5:
                continue  # writes at once, and has to wait
            while ctx.get(dut.busy):
                await ctx.tick()
            assert sets[-1] == expected
        while ctx.get(dut.busy):
            await ctx.tick()
        assert sets[-1] == wanted and len(sets) == 12

    sim = Simulator(dut)
    sim.add_clock(1e-8)
    sim.add_testbench(conductor, background=True)
    sim.add_testbench(host)
    sim.run()


@pytest.mark.parametrize("count", [0, 33])
def test_count_is_checked(count: int) -> None:
    with pytest.raises(ValueError, match=rf"^init must have 1 to 32 words, not {count}$"):
        FeedRegisters(word=32, init=[0] * count)
