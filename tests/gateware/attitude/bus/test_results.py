"""The memory of results: a reader sees one update, whole, whatever the writer does meanwhile."""

import random
import re

import pytest

from boresight.gateware.attitude.bus.results import Results
from boresight.gateware.verilog import to_verilog
from tests.support.bench import pulse, run_bench


async def write(ctx, dut, number: int, words: int = 64, at=None) -> None:
    """One update: word k of update n is 1000 n + k."""
    await pulse(ctx, dut.begin)
    ctx.set(dut.w_en, 1)
    for k in range(words):
        ctx.set(dut.w_index, k)
        ctx.set(dut.w_data, 1000 * number + k)
        ctx.set(dut.complete, k == words - 1)
        await ctx.tick()
    ctx.set(dut.complete, 0)
    ctx.set(dut.w_en, 0)


async def read(ctx, port, index: int) -> int:
    ctx.set(port.index, index)
    await ctx.tick()
    return ctx.get(port.value)


async def take(ctx, port) -> None:
    await pulse(ctx, port.take)


def test_newest_after_complete_and_not_before(simulate) -> None:
    dut = Results(word=32)
    port = dut.ports[0]

    async def bench(ctx):
        ctx.set(dut.w_en, 1)  # of no update: no reader sees it
        ctx.set(dut.w_data, 77)
        for k in range(6):
            ctx.set(dut.w_index, k)
            await ctx.tick()
        assert await read(ctx, port, 5) == 0
        await write(ctx, dut, 1)
        assert await read(ctx, port, 5) == 0  # not taken yet
        await take(ctx, port)
        assert await read(ctx, port, 5) == 1005
        ctx.set(port.take, 1)
        await ctx.tick()
        await write(ctx, dut, 2)
        ctx.set(port.index, 63)
        await ctx.tick()  # the bank follows
        await ctx.tick()
        assert ctx.get(port.value) == 2063

    simulate(dut, bench)


def test_taking_in_the_cycle_of_complete_gives_the_one_before(simulate) -> None:
    dut = Results(word=32)

    async def bench(ctx):
        await write(ctx, dut, 1)
        await pulse(ctx, dut.begin)
        ctx.set(dut.w_en, 1)
        ctx.set(dut.w_data, 2000)
        ctx.set(dut.complete, 1)
        ctx.set(dut.ports[1].take, 1)
        await ctx.tick()
        ctx.set(dut.complete, 0)
        ctx.set(dut.w_en, 0)
        ctx.set(dut.ports[1].take, 0)
        assert await read(ctx, dut.ports[1], 0) == 1000
        for number in (3, 4, 5, 6):
            await write(ctx, dut, number)
            assert await read(ctx, dut.ports[1], 0) == 1000

    simulate(dut, bench)


def test_a_register_behind_the_memory_is_a_cycle_more(simulate) -> None:
    dut = Results(word=32, read_cycles=2)
    port = dut.ports[0]

    async def bench(ctx):
        await write(ctx, dut, 1)
        await take(ctx, port)
        await ctx.tick().repeat(2)
        assert await read(ctx, port, 5) == 1000
        await ctx.tick()
        assert ctx.get(port.value) == 1005

    simulate(dut, bench)


def test_each_copy_has_the_banks_that_are_needed_and_no_more() -> None:
    """Two readers, the newest and the one that is written: four of 64 words."""
    text = to_verilog(Results(word=32), "results", instances=False)
    assert re.findall(r"reg \[31:0\] \w+ \[(\d+):0\];", text) == ["255", "255"]


@pytest.mark.parametrize("readers", [1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_no_reader_ever_sees_two_updates(readers: int, seed: int) -> None:
    dut = Results(word=24, readers=readers)
    done = [False]
    seen: list[list[int]] = [[] for _ in range(readers)]

    async def writer(ctx):
        rng = random.Random(seed)
        for number in range(1, 120):
            await write(ctx, dut, number, rng.choice((1, 2, 8, 64)))
            if rng.random() < 0.2:  # begun and given up
                await pulse(ctx, dut.begin)
                ctx.set(dut.w_en, 1)
                ctx.set(dut.w_index, 0)
                ctx.set(dut.w_data, 7)
                await ctx.tick()
                ctx.set(dut.w_en, 0)
            for _ in range(rng.choice((0, 1, 5))):
                await ctx.tick()
        done[0] = True

    def reader(k: int):
        async def run(ctx):
            rng = random.Random(100 * seed + k)
            port = dut.ports[k]
            while not done[0]:
                await take(ctx, port)
                words = []
                for _ in range(rng.choice((1, 3, 40, 300))):
                    words.append(await read(ctx, port, 0))
                assert len(set(words)) == 1, words
                assert words[0] % 1000 == 0
                seen[k].append(words[0])

        return run

    run_bench(dut, writer, *map(reader, range(readers)))
    for numbers in seen:
        assert numbers == sorted(numbers)
        assert len(set(numbers)) > 5


@pytest.mark.parametrize("readers", [0, 4, 2.0])
def test_readers_are_checked(readers) -> None:
    with pytest.raises(ValueError, match=r"^readers must be 1 to 3, not "):
        Results(word=32, readers=readers)
