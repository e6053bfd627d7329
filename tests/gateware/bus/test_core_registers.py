"""The register bus by itself: flags against events in the same cycle."""

import pytest

from boresight.gateware.bus.core_registers import Registers
from boresight.gateware.machine import CONFIGS
from tests.support.bench import pulse

PROGRAM = 516


def make(digest: int = 0, programs: int = 1) -> Registers:
    return Registers(machine=CONFIGS["small"], digest=digest, programs=programs)


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


async def begin(ctx, dut: Registers) -> None:
    """The program begins, and does not have to restart any more."""
    await pulse(ctx, dut.start)
    await ctx.tick().repeat(2)
    assert not ctx.get(dut.request) and not ctx.get(dut.anew)


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
        await begin(ctx, dut)
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


def test_programs_are_checked() -> None:
    with pytest.raises(ValueError, match=r"^programs must be 1 or more, not 0$"):
        make(programs=0)


def test_digest_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^digest must not be negative, not -5$"):
        make(digest=-5)
