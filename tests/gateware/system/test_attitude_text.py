"""Digits of an angle against whole-number arithmetic; the places of the line are the software's."""

import random

from boresight.gateware.system.attitude_frame import angle_text
from boresight.gateware.system.attitude_text import LINE, AngleDigits, Op

HALF = 1 << 31
#: Words around which digits, signs and roundings change, besides random ones.
EDGES = (0, 1, -1, HALF - 1, -HALF, 1 - HALF, HALF // 2, -HALF // 2, 59_652, 59_653, -59_653)


async def shift(ctx, dut: AngleDigits, word: int) -> None:
    """Start, then the 32 bits."""
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


async def digits_of(ctx, dut: AngleDigits, word: int) -> str:
    """Then each power of ten as often as it can be taken away, and once more."""
    await shift(ctx, dut, word)
    text = ""
    for power in range(5):
        ctx.set(dut.power, power)
        await ctx.tick()  # not asked to take it away
        ctx.set(dut.subtract, 1)
        digit, possible = 0, True
        while possible:
            _, _, possible = await ctx.tick().sample(dut.possible)
            digit += possible
            assert digit < 10
        ctx.set(dut.subtract, 0)
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


def test_an_angle_forgets_the_one_before(simulate) -> None:
    """What was left of it would make a whole hundredth of one that lacks almost nothing."""
    dut = AngleDigits()
    word = pow(36_000 // 32, -1, 1 << 27) * (HALF // 32 - 1) % (1 << 27)
    assert (word * 36_000 + HALF) % (1 << 32) == (1 << 32) - 32

    async def bench(ctx):
        for before in (HALF - 1, -1 << 30):
            await shift(ctx, dut, before)
            digits = await digits_of(ctx, dut, word)
            assert f"+{digits[:3]}.{digits[3:]}" == angle_text(word)

    simulate(dut, bench)


def test_places_of_the_line() -> None:
    kinds = {Op.HEX: "x", Op.SIGN: "s", Op.DIGIT: "d"}
    shape = "".join(kinds.get(place.op) or chr(place.code) for place in LINE)
    assert shape == "sddd.dd sddd.dd sddd.dd xxxx xxxx xxx\r\n"
