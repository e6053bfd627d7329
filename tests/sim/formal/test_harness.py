"""What harnesses are written with: words that may be anything, words that stay, the past."""

import pytest
from amaranth.hdl import Assert, Cover, Elaboratable, Module, Signal
from amaranth.sim import Simulator

from boresight.sim.formal.harness import after_start, before, fixed, reached, unknown
from boresight.sim.formal.prove import Proof, prove


def test_the_cycle_before() -> None:
    m = Module()
    value = Signal(4)
    was, real = before(m, value, "was", init=9), after_start(m)
    seen = []

    async def bench(ctx):
        for given in (3, 5, 7):
            ctx.set(value, given)
            seen.append((ctx.get(was), ctx.get(real)))
            await ctx.tick()

    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()
    assert seen == [(9, 0), (3, 1), (5, 1)]


class Chosen(Elaboratable):
    """Says that a word which the solver chooses, by ``choose``, is the same in every cycle."""

    def __init__(self, choose) -> None:
        self.choose = choose

    def elaborate(self, platform):
        m = Module()
        word = self.choose(m, 3, "word")
        was, real = before(m, word, "was"), after_start(m)
        m.d.comb += [Assert(~real | (word == was)), Cover(word == 5)]
        return m


@pytest.mark.parametrize(("choose", "stays"), [(fixed, True), (unknown, False)])
def test_only_a_fixed_word_stays(choose, stays: bool) -> None:
    result = prove(Proof(name="a.b", claim="", harness=lambda: Chosen(choose), depth=3, induction=2,
                         reset=False))  # fmt: skip
    assert result.proven == stays and result.refuted == (not stays), result.report()


class Passed(Elaboratable):
    """A condition that is true in cycle 2 alone."""

    def elaborate(self, platform):
        m = Module()
        count = Signal(4)
        m.d.sync += count.eq(count + 1)
        m.d.comb += [reached(m, count == 2, "two"), Assert(1)]
        return m


def test_what_was_reached_stays_reached() -> None:
    assert prove(Proof(name="a.b", claim="", harness=Passed, depth=1, cover=range(9, 10))).proven
