"""Benches end, or fail with the reason."""

import gc
from collections.abc import Iterator

import pytest
from amaranth.hdl import Module, Signal
from amaranth.sim import Simulator

# A coroutine that is thrown away while it waits for a tick says so.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(autouse=True)
def swept() -> Iterator[None]:
    """What these tests leave is thrown away here, not in the next one."""
    yield
    gc.collect()


def wait_for_nothing(cycles: int) -> None:
    """A bench that ends after so many cycles, 0: never."""
    m = Module()
    never = Signal()
    m.d.sync += Signal().eq(1)

    async def bench(ctx):
        if cycles:
            await ctx.tick().repeat(cycles)
            return
        while not ctx.get(never):
            await ctx.tick()

    sim = Simulator(m)
    sim.add_clock(1e-8)
    sim.add_testbench(bench)
    sim.run()


@pytest.mark.cycles(100)
def test_a_bench_that_waits_for_ever_fails() -> None:
    wait_for_nothing(90)
    for cycles in (0, 110):
        with pytest.raises(TimeoutError, match=r"^the bench has not ended after 100 cycles$"):
            wait_for_nothing(cycles)


def test_without_a_mark_the_limit_is_as_wide_as_any_bench_needs() -> None:
    wait_for_nothing(10_000)
