"""The bus without the processor: what answers at each address, and what is read elsewhere."""

from typing import Any

import pytest

from boresight.gateware.attitude.soc.layout import (
    CONTROL,
    CONTROL_BASE,
    INTERRUPTS,
    KICK,
    SLOT_BASE,
    SLOT_WORDS,
)
from boresight.gateware.attitude.soc.memory import PAGE_WORDS
from boresight.gateware.attitude.soc.system import Soc
from tests.support.bench import pulse

ADDRESS = {register.name: CONTROL_BASE + 4 * k for k, register in enumerate(CONTROL)}
BIT = {name: 1 << k for k, name in enumerate(CONTROL[4].bits)}
BUS_ERROR = BIT["bus_error"]


class Machine:
    """The parts without the processor, whose buses the bench drives; ``slot`` echoes addresses."""

    def __init__(self, simulate: Any, ports: dict[str, Any], *, slot_answers: bool = True) -> None:
        self.soc = Soc(words=PAGE_WORDS, divisor=8, watchdog_cycles=1 << 14)
        self.simulate, self.ports, self.slot_answers = simulate, ports, slot_answers
        self.slot_writes: list[tuple[int, int]] = []

    def run(self, bench: Any) -> None:
        async def testbench(ctx: Any) -> None:
            await bench(ctx, self)

        self.simulate(self.soc, testbench, self.slot)

    async def slot(self, ctx: Any) -> None:
        """A device that takes three cycles."""
        slot = self.soc.slot
        while self.slot_answers:
            await ctx.tick()
            ctx.set(slot.ack, 0)
            if ctx.get(slot.cyc) and ctx.get(slot.stb):
                await ctx.tick().repeat(2)
                ctx.set(slot.dat_r, ctx.get(slot.adr) + 0x5000)
                ctx.set(slot.ack, 1)
                if ctx.get(slot.we):
                    self.slot_writes.append((ctx.get(slot.adr), ctx.get(slot.dat_w)))
                await ctx.tick()
                ctx.set(slot.ack, 0)

    async def access(
        self, ctx: Any, address: int, word: int | None = None, bus: str = "dBus"
    ) -> tuple[int, int]:
        """(word, cycles) of one access at a byte address."""
        p = {name: self.ports[f"{way}_{bus}Wishbone_{name}"] for name, way in PINS.items()}
        ctx.set(p["ADR"], address >> 2)
        ctx.set(p["WE"], word is not None)
        ctx.set(p["DAT_MOSI"], word or 0)
        ctx.set(p["SEL"], 15)
        ctx.set(p["CYC"], 1)
        ctx.set(p["STB"], 1)
        cycles = 0
        while not ctx.get(p["ACK"]):
            await ctx.tick()
            cycles += 1
        got = ctx.get(p["DAT_MISO"])
        await ctx.tick()
        ctx.set(p["CYC"], 0)
        ctx.set(p["STB"], 0)
        await ctx.tick()
        return got, cycles

    async def status(self, ctx: Any) -> int:
        """The status register but for the free console; what is set is cleared."""
        got, _ = await self.access(ctx, ADDRESS["status"])
        await self.access(ctx, ADDRESS["status"], got)
        return got & ~BIT["console_free"]


PINS = {
    **dict.fromkeys(("ADR", "WE", "DAT_MOSI", "SEL", "CYC", "STB"), "o"),
    **dict.fromkeys(("ACK", "DAT_MISO"), "i"),
}


@pytest.fixture
def machine(simulate, ram, processor) -> Machine:
    return Machine(simulate, processor)


def test_everybody_answers_at_his_place(machine: Machine) -> None:
    async def bench(ctx, here):
        for address in (0, 4, 4 * PAGE_WORDS - 4):
            assert (await here.access(ctx, address, address + 9))[1] == 1
            assert await here.access(ctx, address) == (address + 9, 1)
            assert await here.access(ctx, address, bus="iBus") == (address + 9, 1)
        assert (await here.access(ctx, ADDRESS["alarm"], 0x12345678))[1] == 1
        assert await here.access(ctx, ADDRESS["alarm"]) == (0x12345678, 1)
        for place in (0, 1, SLOT_WORDS - 1):
            got, cycles = await here.access(ctx, SLOT_BASE + 4 * place)
            assert got == 0x5000 + place and 3 <= cycles <= 5
            await here.access(ctx, SLOT_BASE + 4 * place, 7 + place)
        assert here.slot_writes == [(place, 7 + place) for place in (0, 1, SLOT_WORDS - 1)]
        assert await here.status(ctx) == 0

    machine.run(bench)


@pytest.mark.parametrize(
    "address",
    [
        CONTROL_BASE + 4 * 8,
        SLOT_BASE - 4,
        SLOT_BASE + 4 * SLOT_WORDS,
        0xFFFF_FFFC,
        0xC000_0000,
        CONTROL_BASE + (1 << 20),
    ],
)
def test_the_bus_gives_up_at_once_where_no_part_is(machine: Machine, address: int) -> None:
    async def bench(ctx, here):
        assert await here.access(ctx, address) == (0, 1)
        assert await here.status(ctx) == BUS_ERROR
        assert (await here.access(ctx, address, 1))[1] == 1
        assert await here.status(ctx) == BUS_ERROR
        assert here.slot_writes == []

    machine.run(bench)


def test_beyond_the_memory_and_below_the_fence(machine: Machine) -> None:
    async def bench(ctx, here):
        assert await here.access(ctx, 4 * PAGE_WORDS) == (0, 1)
        assert await here.status(ctx) == BUS_ERROR
        assert await here.access(ctx, 4 * PAGE_WORDS, bus="iBus") == (0, 1)
        assert await here.status(ctx) == BUS_ERROR
        await here.access(ctx, 8, 5)
        assert await here.status(ctx) == 0
        await here.access(ctx, ADDRESS["fence"], 1)
        await here.access(ctx, 8, 6)
        assert await here.status(ctx) == BUS_ERROR
        assert (await here.access(ctx, 8))[0] == 5

    machine.run(bench)


@pytest.mark.parametrize("address", [CONTROL_BASE, SLOT_BASE, 0x8000_0008, 0xFFFF_FFF0])
def test_no_instructions_outside_of_the_memory(machine: Machine, address: int) -> None:
    """Not even where the low bits of the address are those of a word that is there."""

    async def bench(ctx, here):
        for place in (0, 8, 4 * PAGE_WORDS - 16):
            await here.access(ctx, place, 0x13)
        assert await here.access(ctx, address, bus="iBus") == (0, 1)
        assert await here.status(ctx) == BUS_ERROR
        assert here.slot_writes == []

    machine.run(bench)


async def half_an_access(ctx: Any, here: Machine, strobe: str, address: int) -> bool:
    """With one of the two strobes; whether it is acknowledged in 20 cycles."""
    ctx.set(here.ports["o_dBusWishbone_ADR"], address >> 2)
    ctx.set(here.ports[f"o_dBusWishbone_{strobe}"], 1)
    seen = False
    for _ in range(20):
        await ctx.tick()
        seen |= bool(ctx.get(here.ports["i_dBusWishbone_ACK"]))
    ctx.set(here.ports[f"o_dBusWishbone_{strobe}"], 0)
    return seen


@pytest.mark.parametrize("strobe", ["CYC", "STB"])
def test_without_a_strobe_nothing_happens(machine: Machine, strobe: str) -> None:
    async def bench(ctx, here):
        for address in (0, CONTROL_BASE, SLOT_BASE, 0xC000_0000):
            assert not await half_an_access(ctx, here, strobe, address), hex(address)
        assert await here.status(ctx) == 0

    machine.run(bench)


@pytest.mark.parametrize("strobe", ["CYC", "STB"])
def test_a_device_that_never_answers(simulate, ram, processor, strobe: str) -> None:
    async def bench(ctx, here):
        assert not await half_an_access(ctx, here, strobe, SLOT_BASE + 8)  # no time of it
        got, cycles = await here.access(ctx, SLOT_BASE + 8)
        assert got == 0 and cycles == here.soc.patience == 4096
        assert await here.status(ctx) == BUS_ERROR
        assert (await here.access(ctx, SLOT_BASE + 8, 1))[1] == 4096, "it has all its time again"
        assert (await here.access(ctx, ADDRESS["cycles"]))[1] == 1

    Machine(simulate, processor, slot_answers=False).run(bench)


def test_interrupts_reach_the_processor(machine: Machine, send) -> None:
    """Device, console, bus error: the bits that the header names; and the timer."""

    async def bench(ctx, here):
        array = here.ports["i_externalInterruptArray"]
        bits = {name: 1 << k for k, name in enumerate(INTERRUPTS)}
        assert len(array) == 32 and ctx.get(array) == 0
        await pulse(ctx, here.soc.interrupt)
        await ctx.tick().repeat(3)
        assert ctx.get(array) == bits["device"]
        assert await here.status(ctx) == BIT["device"] and ctx.get(array) == 0
        await here.access(ctx, 0x9000_0000)
        assert ctx.get(array) == bits["bus_error"]
        await here.status(ctx)
        await send(ctx, here.soc.rx, 8, b"\x81")
        await ctx.tick().repeat(8)
        assert ctx.get(array) == bits["console"]
        assert (await here.access(ctx, ADDRESS["console"]))[0] == 0x81 and ctx.get(array) == 0
        assert not ctx.get(here.ports["i_timerInterrupt"])
        await here.access(ctx, ADDRESS["timer"], 1)
        await ctx.tick().repeat(2)
        assert ctx.get(here.ports["i_timerInterrupt"])

    machine.run(bench)


def test_console_out(machine: Machine) -> None:
    async def bench(ctx, here):
        await ctx.tick().repeat(10)
        assert ctx.get(here.soc.tx)
        await here.access(ctx, ADDRESS["console"], 0x55)
        levels = ""
        for _ in range(90):
            levels += str(ctx.get(here.soc.tx))
            await ctx.tick()
        assert levels.replace("1", "") and levels.count("01") == 5  # start bit, four zeros

    machine.run(bench)


def test_watchdog_restarts_processor_and_device(machine: Machine) -> None:
    async def bench(ctx, here):
        reset = here.ports["i_reset"]
        await ctx.tick().repeat(20)
        await here.access(ctx, ADDRESS["watchdog"], KICK)
        for _ in range((1 << 14) - 20):
            assert not ctx.get(reset) and not ctx.get(here.soc.restart)
            await ctx.tick()
        while not ctx.get(here.soc.restart):
            await ctx.tick()
        assert ctx.get(reset)
        while ctx.get(here.soc.restart):
            assert ctx.get(reset)
            await ctx.tick()
        assert not ctx.get(reset)
        assert await here.status(ctx) == BIT["watchdog_fired"]

    machine.run(bench)
