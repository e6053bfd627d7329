"""Every event is counted once, whatever the others do."""

import random

import pytest

from boresight.gateware.bus.counters import EventCounters


async def read(ctx, dut: EventCounters, index: int) -> int:
    ctx.set(dut.index, index)
    await ctx.tick()
    return ctx.get(dut.value)


@pytest.mark.parametrize("count", [1, 5, 32])
def test_events_as_close_as_allowed(count: int, simulate) -> None:
    dut = EventCounters(count=count, bits=16)
    rng = random.Random(count)
    assert len(dut.index) == (count - 1).bit_length() + 1
    assert dut.interval == 4 * max(1, 1 << (count - 1).bit_length())

    async def bench(ctx):
        last, wanted = [-dut.interval] * count, [0] * count
        for cycle in range(60 * dut.interval):
            events = 0
            for k in range(count):
                if cycle - last[k] >= dut.interval and rng.random() < 0.3:
                    events |= 1 << k
                    last[k], wanted[k] = cycle, wanted[k] + 1
            ctx.set(dut.events, events)
            await ctx.tick()
        ctx.set(dut.events, 0)
        await ctx.tick().repeat(dut.interval + 4)
        assert [await read(ctx, dut, k) for k in range(count)] == wanted
        assert min(wanted) > 30
        assert [await read(ctx, dut, k) for k in range(count, 1 << len(dut.index))] == [0] * (
            (1 << len(dut.index)) - count
        )

    simulate(dut, bench)


def test_every_phase_of_the_turn(simulate) -> None:
    dut = EventCounters(count=4)

    async def bench(ctx):
        for phase in range(dut.interval):
            await ctx.tick().repeat(3 * dut.interval + 1)
            ctx.set(dut.events, 0b1010)
            await ctx.tick()
            ctx.set(dut.events, 0)
            await ctx.tick().repeat(dut.interval + 4)
            assert [await read(ctx, dut, k) for k in range(4)] == [0, phase + 1, 0, phase + 1]

    simulate(dut, bench)


def test_clear_and_wrap(simulate) -> None:
    dut = EventCounters(count=3, bits=4)

    async def count(ctx, events: int, times: int) -> None:
        for _ in range(times):
            ctx.set(dut.events, events)
            await ctx.tick()
            ctx.set(dut.events, 0)
            await ctx.tick().repeat(dut.interval + 3)

    async def bench(ctx):
        await count(ctx, 0b111, 18)
        assert [await read(ctx, dut, k) for k in range(3)] == [2, 2, 2]
        for wait in range(dut.interval):
            ctx.set(dut.clear, 1)
            await ctx.tick()
            ctx.set(dut.clear, 0)
            await ctx.tick().repeat(dut.interval + 4)
            assert [await read(ctx, dut, k) for k in range(3)] == [0, 0, 0]
            await count(ctx, 0b101, 3)
            assert [await read(ctx, dut, k) for k in range(3)] == [3, 0, 3]
            await ctx.tick().repeat(wait + 1)

    simulate(dut, bench)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"count": 0}, r"^count must be an integer from 1 to 256, not 0$"),
        ({"count": 3, "bits": 36}, r"^bits must be an integer from 1 to 35, not 36$"),
    ],
)
def test_parameters_are_checked(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EventCounters(**options)
