"""The register bus: registers, signature, counters, inputs."""

import random

import pytest

from boresight.gateware.attitude.system.csr import Csr, EventCounters
from boresight.gateware.registers import Access, Register
from tests.support.bench import pulse

# -- registers: what is written is read, what is not there does nothing ---------------------------

RO, WO, RW = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE
REGISTERS = (
    Register("magic", 0x40, RO, "", width=32, reset=0xDEAD_BEEF),
    Register("state", 0x41, RO, "", width=9),
    Register("wide", 0x42, RW, "", width=32, reset=7),
    Register("small", 0x44, RW, "", width=3, reset=5),
    Register("choice", 0x45, RW, "", width=2, reset=1, names=("a", "b", "c")),
    Register("order", 0x46, WO, "", width=2),
    Register("clock", 0x47, RO, "", width=32),
)


async def write(ctx, dut: Csr, offset: int, word: int) -> None:
    ctx.set(dut.offset, offset)
    ctx.set(dut.w_data, word)
    await ctx.tick()
    ctx.set(dut.w_en, offset < 8)  # others' writes do not come here
    await ctx.tick()
    ctx.set(dut.w_en, 0)


async def read(ctx, dut: Csr, offset: int) -> int:
    ctx.set(dut.offset, offset)
    await ctx.tick().repeat(dut.read_cycles)
    assert ctx.get(dut.known) == (0x40 + offset in {r.address for r in REGISTERS})
    return ctx.get(dut.r_data)


@pytest.mark.parametrize("read_cycles", [1, 2])
def test_random_accesses_against_a_model(read_cycles: int, simulate) -> None:
    dut, rng = Csr(REGISTERS, read_cycles=read_cycles), random.Random(1)
    widths = {2: ("wide", 32), 4: ("small", 3), 5: ("choice", 2)}
    model = {"wide": 7, "small": 5, "choice": 1, "state": 0, "clock": 0}

    async def bench(ctx):
        for _ in range(1500):
            offset, word = rng.randrange(16), rng.choice([rng.getrandbits(32), rng.randrange(5)])
            for name, width in (("state", 9), ("clock", 32)):
                if rng.random() < 0.3:
                    model[name] = rng.getrandbits(width)
                    ctx.set(getattr(dut, name), model[name])
            if rng.random() < 0.5:
                await write(ctx, dut, offset, word)
                if offset in widths:
                    name, width = widths[offset]
                    if name != "choice" or word & 3 < 3:
                        model[name] = word & (1 << width) - 1
            else:
                wanted = {
                    0: 0xDEAD_BEEF,
                    1: model["state"],
                    7: model["clock"],
                    **{k: model[name] for k, (name, _) in widths.items()},
                }.get(offset, 0)
                assert await read(ctx, dut, offset) == wanted
            for name, _ in widths.values():
                assert ctx.get(getattr(dut, name)) == model[name]

    simulate(dut, bench)


# -- every event is counted once, whatever the others do ------------------------------------------


async def counters_read(ctx, dut: EventCounters, index: int) -> int:
    ctx.set(dut.index, index)
    await ctx.tick().repeat(dut.read_cycles)
    return ctx.get(dut.value)


@pytest.mark.parametrize("read_cycles", [1, 2])
@pytest.mark.parametrize("count", [1, 2, 5, 32])
def test_events_as_close_as_allowed(count: int, read_cycles: int, simulate) -> None:
    dut = EventCounters(count=count, bits=16, read_cycles=read_cycles)
    rng = random.Random(count)
    assert len(dut.index) == (count - 1).bit_length() + 1
    assert dut.interval == 4 * max(1, 1 << (count - 1).bit_length())

    async def bench(ctx):
        last, wanted = [-dut.interval] * count, [0] * count
        for cycle in range(25 * dut.interval):
            events = 0
            for k in range(count):
                if cycle - last[k] >= dut.interval and rng.random() < 0.3:
                    events |= 1 << k
                    last[k], wanted[k] = cycle, wanted[k] + 1
            ctx.set(dut.events, events)
            await ctx.tick()
        ctx.set(dut.events, 0)
        await ctx.tick().repeat(dut.interval + 4)
        assert [await counters_read(ctx, dut, k) for k in range(count)] == wanted
        assert min(wanted) > 12
        assert [await counters_read(ctx, dut, k) for k in range(count, 1 << len(dut.index))] == [
            0
        ] * ((1 << len(dut.index)) - count)

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
        assert [await counters_read(ctx, dut, k) for k in range(3)] == [2, 2, 2]
        for wait in range(dut.interval):
            await pulse(ctx, dut.clear)
            await ctx.tick().repeat(dut.interval + 4)
            assert [await counters_read(ctx, dut, k) for k in range(3)] == [0, 0, 0]
            await count(ctx, 0b101, 3)
            assert [await counters_read(ctx, dut, k) for k in range(3)] == [3, 0, 3]
            await ctx.tick().repeat(wait + 1)

    simulate(dut, bench)
