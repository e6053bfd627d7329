"""Packets through both adapters, at any pace; `sim.formal.blocks.axi` proves the rest."""

from __future__ import annotations

import random
from typing import Any

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.sim import Simulator

from boresight.gateware.bus.axi_stream import StreamFromAxi, StreamToAxi


@pytest.mark.parametrize("pace", [1.0, 0.5])
@pytest.mark.parametrize("word", [18, 32])
def test_words_come_through(word: int, pace: float) -> None:
    """In order, sign-extended; without pauses a word in each cycle, the first two cycles late."""
    rng = random.Random(word)
    top = Module()
    top.submodules.first = first = StreamFromAxi(word=word)
    top.submodules.second = second = StreamToAxi(word=word)
    wiring.connect(top, first.o, second.i)
    sent = [(rng.getrandbits(32), rng.getrandbits(1)) for _ in range(60)]
    came: list[tuple[int, int]] = []
    cycles: list[int] = []

    async def send(ctx: Any) -> None:
        for data, last in sent:
            while rng.random() >= pace:
                await ctx.tick()
            ctx.set(first.axi.tdata, data)
            ctx.set(first.axi.tlast, last)
            ctx.set(first.axi.tvalid, 1)
            await ctx.tick().until(first.axi.tready)
            ctx.set(first.axi.tvalid, 0)

    async def take(ctx: Any) -> None:
        for cycle in range(2000):
            ctx.set(second.axi.tready, rng.random() < pace)
            _, _, valid, ready, data, last = await ctx.tick().sample(
                second.axi.tvalid, second.axi.tready, second.axi.tdata, second.axi.tlast
            )
            if valid and ready:
                came.append((data, last))
                cycles.append(cycle)
            if len(came) == len(sent):
                return

    sim = Simulator(top)
    sim.add_clock(1e-8)
    sim.add_testbench(send, background=True)
    sim.add_testbench(take)
    sim.run()

    def extended(data: int) -> int:
        low = data & ((1 << word) - 1)
        return (low - (low >> word - 1 << word)) & 0xFFFFFFFF

    assert came == [(extended(data), last) for data, last in sent]
    if pace == 1.0:
        assert cycles == list(range(2, 62))
