"""The shorter ways of the simulator give what Amaranth's give."""

import random
from collections.abc import Callable
from typing import Any

import pytest
from amaranth.hdl import Cat, ClockDomain, Const, Module, Signal, signed
from amaranth.sim import Simulator, _async, pysim

from tests.support import quick_values


def test_values_are_those_of_amaranth() -> None:
    assert pysim.eval_value is quick_values._value  # in every test
    state, rng = pysim._PyEngineState(), random.Random(1)
    a, b = Signal(5), Signal(signed(4))
    values = [a, b, Const(-3, signed(5)), Cat(a, b, a[1:3]), Cat(), Cat(b, Cat(b, b)), a + b, -b]
    for _ in range(20):
        state.slots[state.get_signal(a)].curr = rng.randrange(32)
        state.slots[state.get_signal(b)].curr = rng.randrange(-8, 8)
        for value in values:
            assert quick_values._value(state, value) == quick_values._eval_value(state, value)


@pytest.mark.parametrize("options", [{}, {"reset_less": True}, {"async_reset": True}])
@pytest.mark.parametrize("edge", ["pos", "neg"])
def test_edges_are_those_of_amaranth(options: dict[str, bool], edge: str) -> None:
    def seen(collect: Callable[[Any], Any]) -> list[tuple[int, ...]]:
        m, count = Module(), Signal(4)
        out: list[tuple[int, ...]] = []
        m.domains.sync = domain = ClockDomain(clk_edge=edge, **options)
        m.d.sync += count.eq(count + 1)

        async def bench(ctx: Any) -> None:
            for k in range(8):
                if domain.rst is not None:
                    ctx.set(domain.rst, k == 4)
                out.append(await ctx.tick().sample(count))

        simulator = Simulator(m)
        simulator.add_clock(1e-8)
        simulator.add_testbench(bench)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_async.TickTrigger, "_collect_trigger", collect)
            simulator.run()
        return out

    assert seen(quick_values._triggers) == seen(quick_values._collect_trigger)
