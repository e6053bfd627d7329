"""Digits of an angle against whole-number arithmetic; the places of the line are the software's."""

import random

from boresight.gateware.system.attitude_frame import angle_text
from boresight.gateware.system.attitude_text import LINE, AngleDigits, Op

HALF = 1 << 31
#: Words around which digits, signs and roundings change, besides random ones.
EDGES = (0, 1, -1, HALF - 1, -HALF, 1 - HALF, HALF // 2, -HALF // 2, 59_652, 59_653, -59_653)


async def digits_of(ctx, dut: AngleDigits, word: int) -> str:
    """Start, the 32 bits, then each power of ten as often as it can be taken away."""
    ctx.set(dut.start, 1)
    await ctx.tick()
    ctx.set(dut.start, 0)
    ctx.set(dut.negative, word < 0)
    ctx.set(dut.shift, 1)
    for k in range(32):
        ctx.set(dut.bit, word >> k & 1)
        ctx.set(dut.last, k == 31)
        await ctx.tick()
    ctx.set(dut.shift, 0)
    text = ""
    for power in range(5):
        ctx.set(dut.power, power)
        ctx.set(dut.subtract, 1)
        digit = 0
        while ctx.get(dut.possible):
            digit += 1
            assert digit < 10
            await ctx.tick()
        ctx.set(dut.subtract, 0)
        await ctx.tick()
        text += str(digit)
    return text


def test_digits(simulate) -> None:
    dut, rng = AngleDigits(), random.Random(1)

    async def bench(ctx):
        for word in (*EDGES, *(rng.randrange(-HALF, HALF) for _ in range(150))):
            digits = await digits_of(ctx, dut, word)
            sign = "-" if word < 0 else "+"
            assert f"{sign}{digits[:3]}.{digits[3:]}" == angle_text(word), word

    simulate(dut, bench)


def test_what_is_possible_stays_until_it_is_taken(simulate) -> None:
    """Without ``subtract`` nothing changes."""
    dut = AngleDigits()

    async def bench(ctx):
        wanted = await digits_of(ctx, dut, HALF - 1)
        assert wanted == "18000"
        ctx.set(dut.power, 4)
        await ctx.tick().repeat(3)
        assert not ctx.get(dut.possible)
        await digits_of(ctx, dut, 0)
        for power in range(5):
            ctx.set(dut.power, power)
            await ctx.tick()
            assert not ctx.get(dut.possible)

    simulate(dut, bench)


def test_places_of_the_line() -> None:
    kinds = {Op.HEX: "x", Op.SIGN: "s", Op.DIGIT: "d"}
    shape = "".join(kinds.get(place.op) or chr(place.code) for place in LINE)
    assert shape == "sddd.dd sddd.dd sddd.dd xxxx xxxx xxx\r\n"
