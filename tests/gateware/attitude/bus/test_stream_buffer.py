"""A buffer of two words: all of them, in order, without a path from one side to the other."""

import random

import pytest
from amaranth.lib import data

from boresight.gateware.attitude.bus.stream_buffer import StreamBuffer


@pytest.mark.parametrize("offered, taken", [(1.0, 1.0), (0.4, 0.8), (0.8, 0.4)])
def test_words_in_order(offered: float, taken: float, simulate) -> None:
    dut = StreamBuffer(layout=data.StructLayout({"data": 8, "last": 1}))
    rng = random.Random(5)
    sent, came, inside = [], [], 0

    async def bench(ctx):
        nonlocal inside
        for cycle in range(300):
            word = {"data": rng.getrandbits(8), "last": rng.getrandbits(1)}
            valid, ready = rng.random() < offered, rng.random() < taken
            assert ctx.get(dut.empty) == (inside == 0)
            expected = (inside > 0, inside < 2)
            assert (ctx.get(dut.o.valid), ctx.get(dut.i.ready)) == expected
            ctx.set(dut.i.payload, word)
            ctx.set(dut.i.valid, valid)
            ctx.set(dut.o.ready, ready)
            assert (ctx.get(dut.o.valid), ctx.get(dut.i.ready)) == expected
            put, got = valid and inside < 2, ready and inside > 0
            if got:
                came.append((ctx.get(dut.o.payload.data), ctx.get(dut.o.payload.last)))
            if put:
                sent.append((word["data"], word["last"]))
            inside += put - got
            assert cycle == 0 or offered < 1 or inside == 1
            await ctx.tick()

    simulate(dut, bench)
    assert came == sent[: len(came)] and len(sent) - len(came) == inside
    assert len(came) > 90
