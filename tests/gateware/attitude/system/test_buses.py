"""Initiators, registers and results under random access of all at once, against a model."""

import random
from typing import Any

import pytest
from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring

from boresight.gateware.attitude.system.csr import Results
from boresight.gateware.attitude.system.system_bus import BusArbiter, SystemBus, WishboneSlave
from boresight.gateware.registers import Access, Register
from tests.support.bench import run_bench
from tests.support.clock import pause

MAGIC, UNMAPPED, RESULT, COUNTER = 0x400, 0x4FF, 0x505, 0x601
REGISTERS = (
    Register("magic", MAGIC, Access.READ_ONLY, "", width=32, reset=0xDEAD_BEEF),
    *(Register(f"own{k}", 0x401 + k, Access.READ_WRITE, "", width=32, reset=0) for k in range(2)),
)
#: No transfer waits longer: another one, with a slow write of the core.
LONGEST = 100


@pytest.mark.parametrize("read_cycles", [1, 2])
def test_each_transfer_reaches_its_word_and_is_answered_once(read_cycles: int) -> None:
    """A processor, which gives transfers up, and a host; writes of the core wait."""
    m, rng = Module(), random.Random(read_cycles)
    m.submodules.bus = bus = SystemBus(registers=REGISTERS, events=1, read_cycles=read_cycles)
    m.submodules.arbiter = arbiter = BusArbiter()
    m.submodules.slave = slave = WishboneSlave(read_cycles=read_cycles)
    asks = Signal()
    wiring.connect(m, slave.bus, arbiter.initiators[0])
    wiring.connect(m, arbiter.bus, bus.bus)
    m.d.comb += [slave.grant.eq(arbiter.grant[0]), arbiter.request.eq(Cat(slave.request, asks))]
    m.d.comb += bus.read.eq(arbiter.read)
    core_words = dict.fromkeys(range(0x200, 0x202), 0)

    async def core_and_results(ctx: Any) -> None:
        index, core = 0, bus.core
        while True:
            _, _, stb, ack, addr, word, now = await ctx.tick().sample(
                core.w_stb, core.w_ack, core.addr, core.w_data, bus.results.index
            )
            if stb and ack:
                assert addr in core_words
                core_words[addr] = word
            ctx.set(core.w_ack, bool(ctx.get(core.w_stb)) and rng.random() < 0.3)
            ctx.set(core.r_data, core_words.get(addr, 0))
            ctx.set(bus.results.value, ((now, index)[read_cycles - 1] + 1) % 64)
            index = now

    async def by_wishbone(ctx: Any, k: int, addr: int, word: int | None) -> int | None:
        wb, give_up = slave.wb, rng.randrange(1, 12) if rng.random() < 0.3 else LONGEST
        ctx.set(wb.adr, addr)
        ctx.set(wb.dat_w, word or 0)
        ctx.set(wb.we, word is not None)
        ctx.set(Cat(wb.cyc, wb.stb), 3)
        for _ in range(give_up):
            _, _, ack, read = await ctx.tick().sample(wb.ack, wb.dat_r)
            if ack:
                break
        ctx.set(wb.stb, 0)
        assert ack or give_up < LONGEST
        await pause(ctx, not ack)  # a transfer that is given up ends with a cycle without one
        return read if ack else None

    async def by_host(ctx: Any, _: int, addr: int, word: int | None) -> int:
        host = arbiter.initiators[1]
        ctx.set(Cat(host.addr, host.w_data), (word or 0) << 12 | addr)
        ctx.set(host.w_stb, word is not None)
        ctx.set(asks, 1)
        for _ in range(LONGEST):
            done = arbiter.grant[1] if word is None else host.w_ack
            if (await ctx.tick().sample(done))[2]:
                break
        else:
            raise AssertionError("no answer")
        ctx.set(asks, 0)
        await pause(ctx, read_cycles - 1)
        return ctx.get(host.r_data)

    def initiator(k: int) -> Any:
        access, own, core = (by_host if k else by_wishbone), 0x401 + k, 0x200 + k

        async def play(ctx: Any) -> None:
            known = {own: {0}, core: {0}, MAGIC: {0xDEAD_BEEF}, UNMAPPED: {0}, RESULT: {6}}
            for _ in range(300):
                addr = rng.choice([*known])
                word = rng.getrandbits(32) if rng.random() < 0.5 else None
                read = await access(ctx, k, addr, word)
                if word is None:
                    assert read is None or read in known[addr]
                    known[addr] = known[addr] if read is None else {read}
                elif addr in (own, core):  # of one given up both words may be there
                    known[addr] = known[addr] | {word} if read is None else {word}
                await pause(ctx, rng.randrange(3))
            ended.append(k)

        return play

    async def bad_accesses(ctx: Any) -> None:
        while len(ended) < 2:
            await ctx.tick()
        await pause(ctx, 20)
        counts = [await by_host(ctx, 1, COUNTER, None)]
        for addr in (UNMAPPED, MAGIC):
            for word in (None, 1, None):
                await by_host(ctx, 1, addr, word)
                await pause(ctx, 20)
            counts.append(await by_host(ctx, 1, COUNTER, None))
        counted.append([count - counts[0] for count in counts])

    ended: list[int] = []
    counted: list[list[int]] = []
    run_bench(m, *map(initiator, range(2)), bad_accesses, background=[core_and_results])
    assert counted == [[0, 3, 3]]


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
        for _ in range(5000):
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
        assert compared > 4000

    simulate(dut, bench)
