"""The SPI controller under random commands: timing at the pins, whole words, cut frames."""

import random
from typing import Any

from amaranth.hdl import ResetInserter, Signal

from boresight.gateware.attitude.sensors.spi import BITS, HALF_MIN, SpiController


def test_frames_keep_their_times_and_words(simulate) -> None:
    """Whatever a reset cuts short, a frame that begins is whole and begins after a whole stall."""
    dut = SpiController(half_cycles=3, stall_cycles=4)
    reset, rng = Signal(), random.Random(1)

    async def bench(ctx: Any) -> None:
        cs_before = sclk_before = 1
        high, since, edges, payload, reply, sent, answers = 0, 0, 0, 0, 0, 0, 0
        taken, delay, bit, was_cut = [], 0, 1, False
        for _ in range(8000):
            cut = rng.random() < 2.5e-3
            ctx.set(reset, cut)
            ctx.set(dut.i.valid, rng.random() < 0.1)
            ctx.set(dut.i.payload, payload := rng.getrandbits(BITS))
            delay -= 1
            if delay <= 0:
                ctx.set(dut.miso, bit)
            values = await ctx.tick().sample(
                dut.cs_n, dut.sclk, dut.mosi, dut.i.valid & dut.i.ready, dut.o_valid, dut.o_data
            )
            cs, sclk, mosi, take, valid, word = values[2:]
            since += 1
            if cs_before and not cs:
                assert high >= 6 and sclk and sclk_before
                since, edges, sent, reply = 0, 0, 0, rng.getrandbits(BITS)
            elif sclk != sclk_before and not was_cut:
                assert not cs and since >= 3
                since, edges = 0, edges + 1
                if sclk:
                    sent = sent << 1 | mosi
                else:  # as late as is allowed
                    delay = 2 * dut.half_cycles - HALF_MIN - 1
                    bit = reply >> (BITS - 1 - edges // 2) & 1
            if valid:
                assert cs and (edges, since >= 3, sent, word) == (2 * BITS, True, taken[-1], reply)
                answers += 1
            high = high + 1 if cs else 0
            if take and not cut:
                taken.append(payload)
            cs_before, sclk_before, was_cut = cs, sclk, cut
        assert len(taken) > answers > 40

    simulate(ResetInserter(reset)(dut), bench)
