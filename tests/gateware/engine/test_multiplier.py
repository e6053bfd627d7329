"""The multiplier against Python's product."""

import random

import pytest
from amaranth.sim import Simulator

from boresight.gateware.engine.multiplier import Multiplier


def corners(word: int) -> list[int]:
    """Words at the edges of the format and of the slices' 17-bit cut."""
    half = 1 << (word - 1)
    near = {0, 1, half - 1, 1 << 16, (1 << 17) - 1, 1 << 17, (1 << 17) + 1}
    return sorted(v for x in near for v in {x, -x, ~x} if -half <= v < half) + [-half]


@pytest.mark.parametrize("word", [18, 19, 24, 31, 32])
@pytest.mark.parametrize("stalls", [0.0, 0.3])
def test_product(word: int, stalls: float) -> None:
    rng = random.Random(word)
    edge = corners(word)
    half = 1 << (word - 1)
    pairs = [(a, b) for a in edge for b in edge]
    pairs += [(rng.randrange(-half, half), rng.randrange(-half, half)) for _ in range(600)]
    dut = Multiplier(word=word)

    async def bench(ctx):
        waiting = []
        for a, b in pairs + [(0, 0)] * dut.latency:
            ctx.set(dut.a, a)
            ctx.set(dut.b, b)
            ctx.set(dut.en, 0)
            while rng.random() < stalls:
                await ctx.tick()
            ctx.set(dut.en, 1)
            if len(waiting) == dut.latency:
                want_a, want_b = waiting.pop(0)
                assert ctx.get(dut.p) == want_a * want_b, (want_a, want_b)
            waiting.append((a, b))
            await ctx.tick()

    sim = Simulator(dut)
    sim.add_clock(1e-8)
    sim.add_testbench(bench)
    sim.run()


@pytest.mark.parametrize("word, slices", [(18, 1), (19, 4), (32, 4)])
def test_slices(word: int, slices: int) -> None:
    assert Multiplier(word=word).slices == slices


@pytest.mark.parametrize("word", [17, 33, "32"])
def test_word_is_checked(word) -> None:
    with pytest.raises(ValueError, match=rf"^word must be an integer from 18 to 32, not {word!r}$"):
        Multiplier(word=word)
