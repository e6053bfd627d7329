"""Full scale, to the last count, either sign, of the limit that is selected."""

import pytest
from amaranth.hdl import Module, Signal
from amaranth.sim import Simulator

from boresight.gateware.sensors.adis16385_range import at_full_scale


@pytest.mark.parametrize("limits", [(24000, 20000), (1, 2), (32767, 32766), (300, 300)])
def test_against_the_magnitude(limits: tuple[int, int]) -> None:
    word = Signal(16)
    select = Signal()
    result = Signal()
    m = Module()
    m.d.comb += result.eq(at_full_scale(word, select, limits))
    near = {sign * (limit + k) for limit in limits for k in (-1, 0, 1) for sign in (1, -1)}

    async def bench(ctx):
        for value in sorted({*near, 0, 1, -1, -2, 32767, -32767, -32768}):
            for which, limit in enumerate(limits):
                if -32768 <= value < 32768:
                    ctx.set(word, value & 0xFFFF)
                    ctx.set(select, which)
                    await ctx.delay(1e-9)
                    assert ctx.get(result) == (not -limit < value < limit), (value, limit)

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()
