"""The leading-sign count against `model.words.fixed`."""

import random

import pytest

from boresight.gateware.engine.leading import LeadingSignCount
from boresight.model.words.fixed import Arithmetic, leading_sign_count


@pytest.mark.parametrize(
    "arithmetic",
    [
        Arithmetic(word=18),
        Arithmetic(word=21, guard=5),
        Arithmetic(word=24),
        Arithmetic(word=27),
        Arithmetic(word=32),
        Arithmetic(word=32, guard=9),
    ],
    ids=str,
)
def test_count(arithmetic: Arithmetic, simulate) -> None:
    word = arithmetic.word
    rng = random.Random(word)
    values = [
        v
        for n in range(word)
        for x in (1 << n, (1 << n) - 1)
        for v in (x, ~x)
        if arithmetic.min_int <= v <= arithmetic.max_int
    ]
    values += [
        rng.randrange(arithmetic.min_int, arithmetic.max_int) >> rng.randrange(word)
        for _ in range(100)
    ]
    dut = LeadingSignCount(arithmetic=arithmetic)

    async def bench(ctx):
        ctx.set(dut.en, 1)
        for value in values:
            ctx.set(dut.i, value & ((1 << word) - 1))
            ctx.set(dut.capture, 1)
            await ctx.tick()
            # Neither a word that is not captured nor a stalled one counts.
            ctx.set(dut.i, rng.getrandbits(word))
            ctx.set(dut.capture, 0)
            await ctx.tick()
            assert ctx.get(dut.count) == leading_sign_count(value, arithmetic), value
            ctx.set(dut.capture, 1)
            ctx.set(dut.en, 0)
            await ctx.tick().repeat(2)
            ctx.set(dut.en, 1)
            ctx.set(dut.capture, 0)
            await ctx.tick().repeat(2)
            assert ctx.get(dut.count) == leading_sign_count(value, arithmetic), value

    simulate(dut, bench)
