"""The address map of the system, in hardware, against its declaration."""

import pytest
from amaranth.hdl import Module, Mux, Signal, Value

from boresight.gateware.attitude.bus.results import INDEX_BITS
from boresight.gateware.attitude.system.interface import IDENTIFICATION, Place, system_registers
from boresight.gateware.attitude.system.plan import RAW
from boresight.gateware.attitude.system.system_bus import COUNTERS, CSR, FEED, RESULTS, SystemBus
from boresight.gateware.registers.model import Access
from tests.support.bench import pulse, read, run_bench, write

REGISTERS = system_registers(
    filters=("one", "two", "three"),
    clock_hz=100e6,
    build=0x1234_5678_9ABC_DEF0_1122_3344,
    inertial_flags={"a": "", "b": ""},
    compass_flags={"c": ""},
)
EVENTS = 5
ADDRESS = {r.name: r.address for r in REGISTERS}


class Bench:
    """The bus with a core and results that answer with their addresses."""

    def __init__(self, feed: int = 0, read_cycles: int = 1) -> None:
        self.dut = SystemBus(registers=REGISTERS, events=EVENTS, feed=feed, read_cycles=read_cycles)
        self.read_cycles = read_cycles
        self.writes: list[tuple[int, int]] = []
        self.delay: Signal

    async def read(self, ctx, address: int) -> int:
        ctx.set(self.dut.read, 1)
        await read(ctx, self.dut.bus, address)
        ctx.set(self.dut.read, 0)
        return await self.look(ctx, address)

    async def look(self, ctx, address: int) -> int:
        """A word, without the strobe that says so."""
        for _ in range(self.read_cycles):
            word = await read(ctx, self.dut.bus, address)
        return word

    async def write(self, ctx, address: int, word: int) -> int:
        return await write(ctx, self.dut.bus, address, word)

    def run(self, test, *background) -> None:
        top, dut = Module(), self.dut
        top.submodules.dut = dut
        core = dut.core
        waited = Signal(4)
        delay = Signal(4)
        top.d.comb += core.w_ack.eq(core.w_stb & (waited >= delay))
        top.d.sync += [
            waited.eq(Mux(core.w_stb & ~core.w_ack, waited + 1, 0)),
            core.r_data.eq(0xC000_0000 | core.addr),
        ]
        index = dut.results.index
        word: Value = Mux(index == 63, 0, 0xA000_0000 | index)
        for k in range(self.read_cycles):
            on_its_way = Signal(32, name=f"result{k}")
            top.d.sync += on_its_way.eq(word)
            word = on_its_way
        top.d.comb += dut.results.value.eq(word)
        self.delay = delay

        async def watch(ctx):
            async for _, _, ack, addr, data in ctx.tick().sample(
                core.w_ack, core.addr, core.w_data
            ):
                if ack:
                    self.writes.append((addr, data))

        run_bench(top, test, background=[watch, *background])


@pytest.fixture(params=[1, 2])
def bench(request) -> Bench:
    return Bench(read_cycles=request.param)


def test_every_address_reads_what_is_there(bench: Bench) -> None:
    wanted = {address: 0xC000_0000 | address for address in range(512, 517)}
    wanted |= {address: 0xA000_0000 | address & 63 for address in range(RESULTS, RESULTS + 63)}
    for register in REGISTERS:
        wanted[register.address] = register.reset or 0
    wanted[ADDRESS["time"]] = 0x8765_4321

    async def test(ctx):
        ctx.set(bench.dut.time, 0x8765_4321)
        for address in [*range(0x800), *range(0x800, 0x1000, 61)]:
            word = await bench.look(ctx, address)
            assert word == wanted.get(address, 0), hex(address)
        mapped = [
            *range(517),
            *(r.address for r in REGISTERS),
            *range(RESULTS, RESULTS + 64),
            *range(COUNTERS, COUNTERS + EVENTS + 1),
        ]
        assert await bench.read(ctx, ADDRESS["identification"]) == IDENTIFICATION
        bad, count = COUNTERS + EVENTS, 0
        for address in (*mapped[::7], 517, 0x3FF, 0x405, 0x420, 0x540, bad + 1, 0x700, 0xFFF):
            await bench.read(ctx, address)
            await ctx.tick().repeat(bench.dut.counters.interval + 4)
            count += address not in mapped
            assert await bench.read(ctx, bad) == count, hex(address)

    bench.run(test)


def test_every_address_takes_writes(bench: Bench) -> None:
    async def test(ctx):
        for address in range(0x800):
            ctx.set(bench.delay, address % 3)
            cycles = await bench.write(ctx, address, 0x5A00_0000 | address)
            assert cycles == (1 + address % 3 if address < 517 else 2)
        assert bench.writes == [(a, 0x5A00_0000 | a) for a in range(517)]
        for register in REGISTERS:
            word = 0x5A00_0000 | register.address
            masked = word & (1 << register.width) - 1
            legal = not register.names or masked < len(register.names)
            if register.access is Access.READ_WRITE:
                wanted = masked if legal else register.reset
                assert ctx.get(getattr(bench.dut, register.name)) == wanted, register.name
            else:
                wanted = 0 if register.access is Access.WRITE_ONLY else register.reset or 0
            assert await bench.read(ctx, register.address) == wanted, register.name

    bench.run(test)


def test_inputs_and_orders_are_passed_on(bench: Bench) -> None:
    async def test(ctx):
        dut = bench.dut
        for register in (r for r in REGISTERS if r.is_live):
            ctx.set(getattr(dut, register.name), (1 << register.width) - 1)
            assert await bench.read(ctx, register.address) == (1 << register.width) - 1
        ctx.set(dut.bus.addr, ADDRESS["order"])
        ctx.set(dut.bus.w_data, 5)
        ctx.set(dut.bus.w_stb, 1)
        seen = []
        while not seen or not seen[-1][2]:
            _, _, *word = await ctx.tick().sample(dut.order, dut.order_stb, dut.bus.w_ack)
            seen.append(word)
        assert seen == [[0, 0, 0], [5, 1, 1]]
        ctx.set(dut.bus.w_stb, 0)
        _, _, order = await ctx.tick().sample(dut.order)
        assert order == 0

    bench.run(test)


def test_the_place_that_reads_0_is_never_written() -> None:
    assert Place.RAWS + len(RAW) <= (1 << INDEX_BITS) - 1


def test_counters(bench: Bench) -> None:
    async def test(ctx):
        dut = bench.dut
        for k in range(EVENTS):
            for _ in range(k + 1):
                ctx.set(dut.events, 1 << k)
                await ctx.tick()
                ctx.set(dut.events, 0)
                await ctx.tick().repeat(dut.counters.interval)
        await ctx.tick().repeat(4)
        counts = [await bench.read(ctx, COUNTERS + k) for k in range(EVENTS + 1)]
        assert counts == [1, 2, 3, 4, 5, 0]
        await pulse(ctx, dut.clear)
        await ctx.tick().repeat(dut.counters.interval + 4)
        assert [await bench.read(ctx, COUNTERS + k) for k in range(EVENTS + 1)] == [0] * 6

    bench.run(test)


def test_input_registers_wait_until_they_are_free() -> None:
    """And what is written next, to another block, does not."""
    bench, fed = Bench(feed=3), []
    dut, first = bench.dut, FEED

    async def take(ctx):
        """Each word keeps the registers busy for 9 cycles."""
        while True:
            _, _, en, index, data = await ctx.tick().sample(
                dut.feed_en, dut.feed_index, dut.feed_data
            )
            if en:
                fed.append((index, data))
                ctx.set(dut.feed_busy, 1)
                for _ in range(9):
                    await ctx.tick()
                ctx.set(dut.feed_busy, 0)

    async def test(ctx):
        assert [await bench.write(ctx, first + k, 100 + k) for k in range(3)] == [2, 10, 10]
        assert fed == [(k, 100 + k) for k in range(3)]
        assert await bench.write(ctx, 5, 77) == 1 and bench.writes == [(5, 77)]
        bad = COUNTERS + EVENTS
        assert await bench.read(ctx, bad) == 0
        assert await bench.write(ctx, first + 3, 1) == 2, "there are three"
        await ctx.tick().repeat(2 * dut.counters.interval)
        assert await bench.read(ctx, bad) == 1 and len(fed) == 3

    bench.run(test, take)


def test_parameters_are_checked() -> None:
    with pytest.raises(ValueError, match=r"^events must be an integer from 0 to 255, not 256$"):
        SystemBus(registers=REGISTERS, events=256)
    with pytest.raises(ValueError, match=r"^registers must begin at 0x400, not 0x408$"):
        SystemBus(registers=[r for r in REGISTERS if r.address >= CSR + 8][:2], events=1)
