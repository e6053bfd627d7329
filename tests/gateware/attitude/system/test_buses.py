"""Registers and results under random access, against a model."""

import random
from typing import Any

import pytest
from amaranth.hdl import Cat

from boresight.gateware.attitude.system.csr import Results
from boresight.gateware.attitude.system.system_bus import SystemBus
from boresight.gateware.registers import Access, Register
from tests.support.bench import run_bench
from tests.support.clock import pause

MAGIC, UNMAPPED, RESULT, COUNTER = 0x400, 0x4FF, 0x505, 0x601
REGISTERS = (
    Register("magic", MAGIC, Access.READ_ONLY, "", width=32, reset=0xDEAD_BEEF),
    *(Register(f"own{k}", 0x401 + k, Access.READ_WRITE, "", width=32, reset=0) for k in range(2)),
)
#: Cycles within which every transfer ends, a slow write of the core too.
LONGEST = 100


@pytest.mark.parametrize("read_cycles", [1, 2])
def test_each_transfer_reaches_its_word(read_cycles: int) -> None:
    """Reads and writes in any order; writes of the core wait; bad accesses are counted."""
    dut, rng = SystemBus(registers=REGISTERS, events=1, read_cycles=read_cycles), random.Random(1)
    core_words = dict.fromkeys(range(0x200, 0x202), 0)

    async def core_and_results(ctx: Any) -> None:
        index, core = 0, dut.core
        while True:
            _, _, stb, ack, addr, word, now = await ctx.tick().sample(
                core.w_stb, core.w_ack, core.addr, core.w_data, dut.results.index
            )
            if stb and ack:
                assert addr in core_words
                core_words[addr] = word
            ctx.set(core.w_ack, bool(ctx.get(core.w_stb)) and rng.random() < 0.3)
            ctx.set(core.r_data, core_words.get(addr, 0))
            ctx.set(dut.results.value, ((now, index)[read_cycles - 1] + 1) % 64)
            index = now

    async def access(ctx: Any, addr: int, word: int | None) -> int:
        bus = dut.bus
        ctx.set(Cat(bus.addr, bus.w_data), (word or 0) << 12 | addr)
        ctx.set(bus.w_stb, word is not None)
        ctx.set(dut.read, word is None)
        for _ in range(LONGEST):
            if (await ctx.tick().sample(bus.w_ack))[2] or word is None:
                break
        else:
            raise AssertionError("no answer")
        ctx.set(Cat(bus.w_stb, dut.read), 0)
        await pause(ctx, read_cycles - 1)
        return ctx.get(bus.r_data)

    async def host(ctx: Any) -> None:
        known = {MAGIC: 0xDEAD_BEEF, UNMAPPED: 0, RESULT: 6}
        known |= dict.fromkeys((0x200, 0x201, 0x401, 0x402), 0)
        for _ in range(300):
            addr = rng.choice([*known])
            word = rng.getrandbits(32) if rng.random() < 0.5 else None
            read = await access(ctx, addr, word)
            if word is None:
                assert read == known[addr], hex(addr)
            elif addr in (0x200, 0x201, 0x401, 0x402):
                known[addr] = word
            await pause(ctx, rng.randrange(3))
        await pause(ctx, 20)
        counts = [await access(ctx, COUNTER, None)]
        for addr in (UNMAPPED, MAGIC):
            for word in (None, 1, None):
                await access(ctx, addr, word)
                await pause(ctx, 20)
            counts.append(await access(ctx, COUNTER, None))
        assert [count - counts[0] for count in counts] == [0, 3, 3]

    run_bench(dut, host, background=[core_and_results])


@pytest.mark.parametrize("read_cycles", [1, 2])
def test_a_reader_sees_the_words_of_one_update(read_cycles: int, simulate) -> None:
    """Of the newest at its take, whatever is written since; the writer never waits."""
    dut, rng = Results(read_cycles=read_cycles), random.Random(1)

    async def bench(ctx: Any) -> None:
        now: dict[int, int] = {}
        newest: dict[int, int] = {}
        held = [newest, newest]
        due: list[list[int | None]] = [[None] * read_cycles for _ in range(2)]
        complete, compared = 0, 0
        for _ in range(2000):
            w_en, complete = (0, 0) if complete else (rng.random() < 0.7, rng.random() < 0.15)
            index, word = rng.randrange(4), rng.getrandbits(16)
            ctx.set(Cat(dut.w_en, dut.complete), w_en | complete << 1)
            ctx.set(Cat(dut.w_index, dut.w_data), word << 6 | index)
            takes = [rng.random() < 0.1 for _ in range(2)]
            looks = [rng.randrange(4) for _ in range(2)]
            for port, take, look in zip(dut.ports, takes, looks, strict=True):
                ctx.set(port.take, take)
                ctx.set(port.index, look)
            _, _, *values = await ctx.tick().sample(*(port.value for port in dut.ports))
            for k, value in enumerate(values):
                expected = due[k].pop(0)
                assert expected in (None, value)
                compared += expected is not None
                due[k].append(held[k].get(looks[k]))
                held[k] = newest if takes[k] else held[k]
            if w_en:
                now[index] = word
            if complete:
                newest, now = now, {}
        assert compared > 1600

    simulate(dut, bench)
