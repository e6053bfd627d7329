"""The register bus by itself: flags against events in the same cycle."""

import pytest

from boresight.gateware.bus.core_registers import Registers
from boresight.gateware.machine import CONFIGS
from tests.support.bench import pulse

PROGRAM = 516


def make(digest: int = 0, programs: int = 1) -> Registers:
    return Registers(machine=CONFIGS["small"], digest=digest, programs=programs)


@pytest.mark.parametrize("event, bit", [("saturated", 0), ("framing", 1)])
def test_an_event_beats_its_clearing(event: str, bit: int, simulate) -> None:
    dut = make()

    async def bench(ctx):
        ctx.set(dut.bus.addr, 512)
        ctx.set(dut.bus.w_data, 3)
        ctx.set(dut.bus.w_stb, 1)
        ctx.set(getattr(dut, event), 1)
        await ctx.tick()
        ctx.set(getattr(dut, event), 0)
        ctx.set(dut.bus.w_stb, 0)
        await ctx.tick()
        assert ctx.get(dut.bus.r_data) == 1 << bit
        await pulse(ctx, dut.bus.w_stb)
        await ctx.tick()
        assert ctx.get(dut.bus.r_data) == 0

    simulate(dut, bench)


def test_saturated_update_tells_of_the_last_update(simulate) -> None:
    dut = make()

    async def update(ctx, *events: str) -> int:
        for event in events:
            ctx.set(getattr(dut, event), 1)
            await ctx.tick()
            ctx.set(getattr(dut, event), 0)
        await pulse(ctx, dut.commit)
        return ctx.get(dut.saturated_update)

    async def bench(ctx):
        assert await update(ctx) == 0
        assert await update(ctx, "saturated") == 1
        await ctx.tick().repeat(3)
        assert ctx.get(dut.saturated_update) == 1
        assert await update(ctx) == 0
        # What saturated before the fault belongs to no update.
        assert await update(ctx, "saturated", "framing") == 0
        assert await update(ctx) == 0
        ctx.set(dut.saturated, 1)
        assert await update(ctx) == 1

    simulate(dut, bench)


def test_updates_and_both_words_of_the_build(simulate) -> None:
    dut = make(digest=0x5_FEDC_BA98_7654_3210)

    async def bench(ctx):
        for updates in range(3):
            for address, word in ((513, updates), (514, 0x7654_3210), (515, 0xFEDC_BA98)):
                ctx.set(dut.bus.addr, address)
                await ctx.tick()
                assert ctx.get(dut.bus.r_data) == word
            await pulse(ctx, dut.commit)

    simulate(dut, bench)


PARAMETERS = [(0, True), (255, True), (256, False), (511, False), (512, False), (1023, False)]


@pytest.mark.parametrize("programs", [1, 3])
@pytest.mark.parametrize("address, waits", [*PARAMETERS, (515, False), (517, False), (772, False)])
def test_only_parameters_wait(address: int, waits: bool, programs: int, simulate) -> None:
    dut = make(programs=programs)

    async def bench(ctx):
        ctx.set(dut.bus.addr, address)
        assert not ctx.get(dut.request) and not ctx.get(dut.bus.w_ack)
        ctx.set(dut.bus.w_stb, 1)
        assert ctx.get(dut.bus.w_ack) != waits
        await ctx.tick()
        assert ctx.get(dut.request) == waits
        assert not waits or not ctx.get(dut.switch)
        assert ctx.get(dut.bus.w_ack) != waits
        ctx.set(dut.grant, 1)
        assert ctx.get(dut.bus.w_ack)
        await ctx.tick()
        assert not ctx.get(dut.request), "asked again for what is done"
        assert ctx.get(dut.program) == 0

    simulate(dut, bench)


@pytest.mark.parametrize(
    "programs, number, legal",
    [
        (1, 0, False),
        (1, 1, False),
        (2, 1, True),
        (2, 2, False),
        (3, 2, True),
        (3, 3, False),
        (4, 3, True),
        (4, 4, False),
        (4, 1 << 31 | 1, False),
        (2, 0xFFFFFFFF, False),
    ],
)
def test_program(programs: int, number: int, legal: bool, simulate) -> None:
    dut = make(programs=programs)

    async def bench(ctx):
        ctx.set(dut.bus.addr, PROGRAM)
        ctx.set(dut.bus.w_data, number)
        ctx.set(dut.bus.w_stb, 1)
        assert ctx.get(dut.bus.w_ack) != legal
        await ctx.tick().repeat(3)
        assert ctx.get(dut.request) == legal
        assert ctx.get(dut.bus.r_data) == 0
        if legal:
            assert ctx.get(dut.switch)
            ctx.set(dut.grant, 1)
            assert ctx.get(dut.bus.w_ack)
        await ctx.tick()
        ctx.set(dut.bus.w_stb, 0)
        ctx.set(dut.grant, 0)
        assert ctx.get(dut.program) == (number if legal else 0)
        await ctx.tick()
        assert ctx.get(dut.bus.r_data) == (number if legal else 0)
        ctx.set(dut.bus.addr, 0)
        await ctx.tick()
        ctx.set(dut.grant, 1)  # a parameter's: the program stays
        await ctx.tick().repeat(2)
        assert ctx.get(dut.program) == (number if legal else 0)

    simulate(dut, bench)


def test_flags_are_cleared_at_their_address_only(simulate) -> None:
    dut = make(programs=2)

    async def bench(ctx):
        await pulse(ctx, dut.saturated)
        ctx.set(dut.bus.addr, PROGRAM)
        ctx.set(dut.bus.w_data, 1)
        ctx.set(dut.bus.w_stb, 1)
        ctx.set(dut.grant, 1)
        await ctx.tick().repeat(3)
        ctx.set(dut.bus.w_stb, 0)
        ctx.set(dut.bus.addr, 512)
        await ctx.tick()
        assert ctx.get(dut.bus.r_data) & 1

    simulate(dut, bench)


def test_every_bit_of_the_status(simulate) -> None:
    dut = make()

    async def bench(ctx):
        ctx.set(dut.bus.addr, 512)
        for event in ("saturated", "framing"):
            for idle in range(2):
                for parity in range(2):
                    ctx.set(dut.idle, idle)
                    ctx.set(dut.parity, parity)
                    await ctx.tick()
                    assert ctx.get(dut.bus.r_data) & 0b1100 == idle << 2 | parity << 3
            ctx.set(getattr(dut, event), 1)
            await ctx.tick()

    simulate(dut, bench)


def test_programs_are_checked() -> None:
    with pytest.raises(ValueError, match=r"^programs must be 1 or more, not 0$"):
        make(programs=0)


def test_digest_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^digest must not be negative, not -5$"):
        make(digest=-5)


def test_a_port_chooses_the_program(simulate) -> None:
    dut = Registers(machine=CONFIGS["small"], digest=0, programs=3, selector=True)

    async def bench(ctx):
        await ctx.tick()
        assert ctx.get(dut.chosen) and not ctx.get(dut.request)
        ctx.set(dut.choice, 2)
        await ctx.tick()
        assert not ctx.get(dut.chosen) and ctx.get(dut.request) and ctx.get(dut.switch)
        await pulse(ctx, dut.grant)
        assert ctx.get(dut.program) == 2 and not ctx.get(dut.chosen)
        await ctx.tick()
        assert ctx.get(dut.chosen) and not ctx.get(dut.request) and not ctx.get(dut.switch)

    simulate(dut, bench)


def test_beside_that_port_a_write_waits_for_a_grant_of_its_own(simulate) -> None:
    dut = Registers(machine=CONFIGS["small"], digest=0, programs=3, selector=True)

    async def bench(ctx):
        assert not ctx.get(dut.bus.w_ack)
        ctx.set(dut.bus.w_stb, 1)
        ctx.set(dut.choice, 2)
        await ctx.tick()
        ctx.set(dut.grant, 1)
        assert ctx.get(dut.switch) and not ctx.get(dut.bus.w_ack)
        await ctx.tick()
        ctx.set(dut.grant, 0)
        await ctx.tick()
        assert ctx.get(dut.request) and not ctx.get(dut.bus.w_ack)
        ctx.set(dut.grant, 1)
        assert ctx.get(dut.bus.w_ack)
        ctx.set(dut.grant, 0)
        ctx.set(dut.bus.addr, 512)
        assert ctx.get(dut.bus.w_ack)

    simulate(dut, bench)
