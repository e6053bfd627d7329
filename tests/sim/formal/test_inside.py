"""Registers by the names that ``elaborate`` keeps them in, with no change to the component."""

import sys

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from boresight.sim.formal.inside import Inside


class Count(wiring.Component):
    """A register that counts."""

    go: In(1)

    def elaborate(self, platform):
        m = Module()
        count = Signal(4)
        with m.If(self.go):
            m.d.sync += count.eq(count + 1)
        return m


class Whole(wiring.Component):
    """A counter, a memory, a machine of three states."""

    go: In(1)
    done: Out(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.count = inner = Count()
        m.submodules.words = memory.Memory(shape=3, depth=4, init=[1, 2])
        several = [Signal(name=f"s{k}") for k in range(2)]
        number = 5
        m.d.comb += [inner.go.eq(self.go), self.done.eq(several[0] | number)]
        with m.FSM():
            with m.State("FIRST"):
                m.next = "SECOND"
            with m.State("SECOND"):
                m.next = "THIRD"
            with m.State("THIRD"):
                pass
        return m


@pytest.fixture
def inside() -> Inside:
    return Inside(Whole(), None)


def test_names(inside: Inside) -> None:
    assert list(inside.parts) == ["count"] and list(inside.memories) == ["words"]
    assert inside["count.count"] is inside.parts["count"]["count"]
    assert [s.name for s in inside.variable("several")] == ["s0", "s1"]
    assert sys.getprofile() is None


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("total", r"Whole\.elaborate must have a signal total"),
        ("number", r"Whole\.elaborate must have a signal number"),
        ("count.total", r"Count\.elaborate must have a signal total"),
        ("words.data", "Whole must have a part words, not only count"),
        ("count.part.x", "Count must have a part part, not only no part"),
    ],
)
def test_names_that_are_none(name: str, message: str, inside: Inside) -> None:
    with pytest.raises(KeyError, match=message):
        inside[name]


def test_they_are_the_registers_that_run(inside: Inside) -> None:
    """The module stands for the component: what is seen of it is what it does."""
    m = Module()
    m.submodules.dut = inside.module
    states, legal = Signal(2), Signal()
    m.d.comb += [
        legal.eq(inside.legal()),
        states.eq(inside.state("SECOND", "THIRD") + inside.state("THIRD")),
    ]
    seen = []

    async def bench(ctx):
        ctx.set(inside.variable("self").go, 1)
        for _ in range(4):
            seen.append((ctx.get(inside["count.count"]), ctx.get(states), ctx.get(legal)))
            await ctx.tick()

    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()
    assert seen == [(0, 0, 1), (1, 1, 1), (2, 2, 1), (3, 2, 1)]


def test_a_code_that_is_no_state(inside: Inside) -> None:
    m = Module()
    m.submodules.dut = inside.module
    state = inside.module._generated["fsm"].state
    code, legal = Signal(2), Signal()
    m.d.comb += legal.eq(inside.legal())
    assert len(state) == len(code)

    async def bench(ctx):
        for k in range(4):
            ctx.set(state, k)
            assert ctx.get(legal) == (k < 3)

    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()
