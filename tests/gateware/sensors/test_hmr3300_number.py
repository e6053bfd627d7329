"""Numbers digit by digit against Python's, beyond the range that the grammar leaves."""

import random

import pytest

from boresight.gateware.sensors.hmr3300_number import BITS, COUNT_MAX, HEADING_MAX, DecimalNumber

NUMBERS = [
    0,
    1,
    9,
    10,
    599,
    600,
    601,
    3599,
    3600,
    32_767,
    32_768,
    65_535,
    65_536,
    65_545,
    98_304,
    99_999,
    *random.Random(1).sample(range(100_000), 60),
]


@pytest.mark.parametrize(
    "tenths, first, limit", [(0, 0, COUNT_MAX), (0, 1, COUNT_MAX), (1, 1, HEADING_MAX), (1, 0, 600)]
)
def test_value_and_limit(tenths: int, first: int, limit: int, simulate) -> None:
    dut = DecimalNumber(angle_max=600)

    async def bench(ctx):
        ctx.set(dut.tenths, tenths)
        ctx.set(dut.first, first)
        stored: list[int] = []
        for k, number in enumerate(NUMBERS):
            negative = k % 2
            for digit in str(number):
                ctx.set(dut.digit, int(digit))
                ctx.set(dut.take, 1)
                await ctx.tick()
                ctx.set(dut.take, 0)
                await ctx.tick().repeat(BITS + 1)
            assert ctx.get(dut.over) == (number > limit), number
            ctx.set(dut.negative, negative)
            ctx.set(dut.store, 1)
            await ctx.tick()
            ctx.set(dut.store, 0)
            await ctx.tick().repeat(BITS)
            stored.append((-number if negative else number) % (1 << BITS))
            values = ctx.get(dut.values)
            for back, value in enumerate(reversed(stored[-3:])):
                assert values >> BITS * (2 - back) & (1 << BITS) - 1 == value

    simulate(dut, bench)
