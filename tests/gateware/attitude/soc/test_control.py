"""Control block: every register, and what happens without the bus."""

from functools import partial

import pytest
from amaranth.hdl import ClockDomain, Module

from boresight.gateware.attitude.soc.control import Control
from boresight.gateware.attitude.soc.layout import CONTROL, KICK
from tests.support.bench import run_bench

ADDRESS = {register.name: k for k, register in enumerate(CONTROL)}
BIT = {name: 1 << k for k, name in enumerate(CONTROL[ADDRESS["status"]].bits)}


def run(bench, *, background=None, **options) -> None:
    dut = Control(**{"divisor": 8, "watchdog_cycles": 1024, "pages": 24, **options})
    top = Module()
    top.domains.sync = ClockDomain()
    top.submodules.dut = dut
    beside = [] if background is None else [partial(background, dut=dut)]
    run_bench(top, partial(bench, dut=dut), background=beside)


async def transfer(ctx, dut, name: str, word: int | None = None) -> int:
    """Write a word, or read one: two cycles."""
    ctx.set(dut.bus.adr, ADDRESS[name])
    ctx.set(dut.bus.we, word is not None)
    ctx.set(dut.bus.dat_w, word or 0)
    ctx.set(dut.bus.cyc, 1)
    ctx.set(dut.bus.stb, 1)
    await ctx.tick()
    assert ctx.get(dut.bus.ack)
    got = ctx.get(dut.bus.dat_r)
    await ctx.tick()
    assert not ctx.get(dut.bus.ack), "one acknowledgement a transfer"
    ctx.set(dut.bus.cyc, 0)
    ctx.set(dut.bus.stb, 0)
    return got


def test_cycles_count() -> None:
    async def bench(ctx, dut):
        first = await transfer(ctx, dut, "cycles")
        await ctx.tick().repeat(100)
        assert await transfer(ctx, dut, "cycles") - first == 102

    run(bench)


def test_timer() -> None:
    async def bench(ctx, dut):
        now = await transfer(ctx, dut, "cycles")
        await transfer(ctx, dut, "alarm", now + 100)
        assert await transfer(ctx, dut, "alarm") == now + 100
        await ctx.tick().repeat(200)
        assert not ctx.get(dut.timer), "it is off"
        await transfer(ctx, dut, "timer", 1)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.timer)
        now = await transfer(ctx, dut, "cycles")
        await transfer(ctx, dut, "alarm", now + 50)
        assert not ctx.get(dut.timer)
        while not ctx.get(dut.timer):
            await ctx.tick()
        assert 50 <= await transfer(ctx, dut, "cycles") - now <= 54
        await transfer(ctx, dut, "timer", 0)
        await ctx.tick()
        assert not ctx.get(dut.timer)

    run(bench)


def test_no_interrupt_while_the_alarm_changes() -> None:
    seen = []

    async def watch(ctx, dut):
        async for _, _, timer in ctx.tick().sample(dut.timer):
            seen.append(timer)

    async def bench(ctx, dut):
        await transfer(ctx, dut, "alarm", 500)
        await transfer(ctx, dut, "timer", 1)
        await transfer(ctx, dut, "alarm", 600)
        await ctx.tick().repeat(10)

    run(bench, background=watch)
    assert seen and not any(seen)


def test_an_interrupt_ends_with_the_acknowledgement_of_a_new_alarm() -> None:
    levels = []

    async def watch(ctx, dut):
        async for _, _, ack, timer in ctx.tick().sample(dut.bus.ack, dut.timer):
            if ack:
                levels.append(timer)

    async def bench(ctx, dut):
        await transfer(ctx, dut, "timer", 1)
        for alarm in (0, 500):
            await ctx.tick().repeat(10)
            await transfer(ctx, dut, "alarm", alarm)
        assert levels == [0, 0, 0]

    run(bench, background=watch)


def test_alarm_across_the_wrap() -> None:
    async def bench(ctx, dut):
        await transfer(ctx, dut, "alarm", 2**32 - 5)  # long past, though the number is large
        await transfer(ctx, dut, "timer", 1)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.timer)

    run(bench)


@pytest.mark.parametrize(
    "ahead, rings",
    [(0x7FFF_FF00, False), (0x6000_0000, False), (-0x5000_0000, True), (-0x7FFF_FF00, True)],
)
def test_alarm_half_the_range_away(ahead: int, rings: bool) -> None:
    async def bench(ctx, dut):
        await transfer(ctx, dut, "timer", 1)
        now = await transfer(ctx, dut, "cycles")
        await transfer(ctx, dut, "alarm", now + ahead & 0xFFFF_FFFF)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.timer) == rings

    run(bench)


def test_console_out(listen) -> None:
    received = bytearray()
    dut = Control(divisor=8, watchdog_cycles=4096, pages=24)

    async def bench(ctx):
        await ctx.tick().repeat(4)
        for byte in b"hi":
            while not await transfer(ctx, dut, "status") & BIT["console_free"]:
                pass
            await transfer(ctx, dut, "console", byte)
        assert not await transfer(ctx, dut, "status") & BIT["console_free"]
        await transfer(ctx, dut, "console", ord("!"))  # lost
        await ctx.tick().repeat(200)

    run_bench(dut, bench, background=[listen(dut.tx, 8, received)])
    assert received == b"hi"


def test_console_in(send) -> None:
    async def bench(ctx, dut):
        await send(ctx, dut.rx, 8, b"x")
        await ctx.tick().repeat(8)
        assert ctx.get(dut.console_full)
        for _ in range(2):  # nothing is lost while it waits
            status = await transfer(ctx, dut, "status")
            assert status == BIT["console_free"] | BIT["console_full"]
        assert await transfer(ctx, dut, "console") == ord("x")
        assert not ctx.get(dut.console_full)
        await send(ctx, dut.rx, 8, b"yz")
        await ctx.tick().repeat(8)
        assert await transfer(ctx, dut, "status") & BIT["console_lost"]
        assert await transfer(ctx, dut, "console") == ord("z")
        await transfer(ctx, dut, "status", BIT["bus_error"])
        assert await transfer(ctx, dut, "status") & BIT["console_lost"]
        await transfer(ctx, dut, "status", BIT["console_lost"])
        assert not await transfer(ctx, dut, "status") & BIT["console_lost"]
        await send(ctx, dut.rx, 8, b"\0", stop=0)
        await ctx.tick().repeat(8)
        assert await transfer(ctx, dut, "status") & BIT["console_lost"], "no stop bit"

    run(bench)


def test_every_bit_of_a_received_byte(send) -> None:
    async def bench(ctx, dut):
        for byte in (*(1 << bit for bit in range(8)), 0xFF, 0x00, 0xA5):
            await send(ctx, dut.rx, 8, bytes([byte]))
            await ctx.tick().repeat(8)
            assert await transfer(ctx, dut, "console") == byte

    run(bench)


@pytest.mark.parametrize(
    ("port", "flag", "level"), [("bus_error", "bus_error", "error"), ("asks", "device", "device")]
)
def test_sticky_flags(port: str, flag: str, level: str) -> None:
    async def bench(ctx, dut):
        assert not await transfer(ctx, dut, "status") & BIT[flag]
        ctx.set(getattr(dut, port), 1)
        await ctx.tick()
        ctx.set(getattr(dut, port), 0)
        await ctx.tick().repeat(5)
        assert ctx.get(getattr(dut, level))
        assert await transfer(ctx, dut, "status") & ~BIT["console_free"] == BIT[flag]
        await transfer(ctx, dut, "status", BIT[flag])
        assert not ctx.get(getattr(dut, level))
        ctx.set(getattr(dut, port), 1)
        await transfer(ctx, dut, "status", BIT[flag])
        assert ctx.get(getattr(dut, level)), "what happens wins over what clears"

    run(bench)


def test_watchdog() -> None:
    async def bench(ctx, dut):
        for upper in range(5):  # half of the word, which does not matter
            await ctx.tick().repeat(900)
            assert not ctx.get(dut.restart)
            await transfer(ctx, dut, "watchdog", upper << 16 | KICK)
        assert not await transfer(ctx, dut, "status") & BIT["watchdog_fired"]
        await transfer(ctx, dut, "fence", 7)
        await ctx.tick().repeat(900)
        for wrong in (KICK + 1, KICK ^ 0x8000, KICK ^ 0x0100, 0):  # not the key
            await transfer(ctx, dut, "watchdog", wrong)
        waited = 0
        while not ctx.get(dut.restart):
            await ctx.tick()
            waited += 1
        assert waited <= 130
        length = 0
        while ctx.get(dut.restart):
            await ctx.tick()
            length += 1
        assert length == 7
        assert ctx.get(dut.fence) == 0, "a restart may load its data anew"
        assert await transfer(ctx, dut, "status") & BIT["watchdog_fired"]
        await transfer(ctx, dut, "status", BIT["watchdog_fired"])
        assert not await transfer(ctx, dut, "status") & BIT["watchdog_fired"]

    run(bench)


def test_a_restart_ends_the_timer() -> None:
    """What the program that was restarted had asked for does not disturb the next."""

    async def bench(ctx, dut):
        await transfer(ctx, dut, "timer", 1)
        waited = 2
        while not ctx.get(dut.restart):
            await ctx.tick()
            waited += 1
        assert waited == 1 << dut.watchdog_bits, "from the reset on"
        await transfer(ctx, dut, "alarm", await transfer(ctx, dut, "cycles") + 40)
        for _ in range(100):
            assert not ctx.get(dut.timer)
            await ctx.tick()

    run(bench)


def test_watchdog_to_the_cycle() -> None:
    """From the key, or from one restart to the next, all of its count."""

    async def bench(ctx, dut):
        await transfer(ctx, dut, "watchdog", KICK)
        waited = []
        for level in (1, 0, 1, 0, 1):
            waited.append(0)
            while ctx.get(dut.restart) != level:
                await ctx.tick()
                waited[-1] += 1
        assert waited[1] == waited[3] == 7
        assert waited[1] + waited[2] == waited[3] + waited[4] == 1 << dut.watchdog_bits
        assert waited[0] == (1 << dut.watchdog_bits) - 1  # the write's second cycle counts

    run(bench)


def test_fence_only_rises() -> None:
    async def bench(ctx, dut):
        for written, stands in ((5, 5), (3, 5), (24, 24), (0, 24)):
            await transfer(ctx, dut, "fence", written)
            assert ctx.get(dut.fence) == stands

    run(bench)


@pytest.mark.parametrize("pages", [31, 32])
def test_fence_reaches_behind_the_last_page(pages: int) -> None:
    dut = Control(divisor=8, watchdog_cycles=1024, pages=pages)
    assert len(dut.fence) == pages.bit_length()


def test_unused_registers_read_zero() -> None:
    async def bench(ctx, dut):
        for name in ("timer", "watchdog", "fence"):
            await transfer(ctx, dut, "alarm", 77)
            assert await transfer(ctx, dut, name) == 0

    run(bench)


@pytest.mark.parametrize("missing", ["cyc", "stb"])
def test_without_a_strobe_nothing_happens(missing: str) -> None:
    async def bench(ctx, dut):
        ctx.set(dut.bus.adr, ADDRESS["fence"])
        ctx.set(dut.bus.dat_w, 5)
        ctx.set(dut.bus.we, 1)
        ctx.set(dut.bus.stb if missing == "cyc" else dut.bus.cyc, 1)
        for _ in range(3):
            await ctx.tick()
            assert not ctx.get(dut.bus.ack) and not ctx.get(dut.fence)

    run(bench)


@pytest.mark.parametrize("cycles, bits", [(1024, 10), (1025, 11), (2048, 11), (1 << 24, 24)])
def test_watchdog_is_rounded_up_to_a_power_of_two(cycles: int, bits: int) -> None:
    assert Control(divisor=8, watchdog_cycles=cycles, pages=24).watchdog_bits == bits


def test_bounds() -> None:
    with pytest.raises(ValueError, match=r"^watchdog_cycles must be 1024 to 2\^32, not 1000$"):
        Control(divisor=8, watchdog_cycles=1000, pages=24)
