"""Tables and layouts of the conductor; test_conductor.py runs it whole."""

from types import SimpleNamespace
from typing import Any

import pytest
from amaranth.hdl import Const, Module, Signal
from amaranth.sim import Simulator

from boresight.gateware.system.conductor_words import Job, Step, last_words, table


def comb(m: Module, bench) -> None:
    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()


@pytest.mark.parametrize("entries", [[5], [1, 2], [7, 7, 7], [3, 1, 4, 1, 5]])
def test_tables_end_with_their_last_entry(entries: list[int]) -> None:
    m = Module()
    index = Signal(3)
    found = Signal(8)
    m.d.comb += found.eq(table(index, entries))

    async def bench(ctx):
        for k in range(8):
            ctx.set(index, k)
            assert ctx.get(found) == entries[min(k, len(entries) - 1)]

    comb(m, bench)


def test_a_table_of_one_entry_asks_for_no_number() -> None:
    assert isinstance(table(Signal(3), [7, 7]), Const)
    assert not isinstance(table(Signal(3), [7, 8]), Const)


#: Estimator 1 reads what estimator 0 gives; records of 4 and 7 words.
PLAN: Any = SimpleNamespace(
    filters=2, chains=((0,), (0, 1)), feed=SimpleNamespace(records=((None,) * 4, (None,) * 7))
)


def test_steps_along_a_chain() -> None:
    m, step = Module(), Step(PLAN)
    program = Signal(2)
    following = Signal(2)
    last = Signal()
    m.d.comb += [program.eq(step.program), following.eq(step.following), last.eq(step.last)]

    async def bench(ctx):
        for running, at, wanted in ((0, 0, (0, 0, 1)), (1, 0, (0, 1, 0)), (1, 1, (1, 1, 1))):
            ctx.set(step.running, running)
            ctx.set(step.step, at)
            assert (ctx.get(program), ctx.get(following), ctx.get(last)) == wanted

    comb(m, bench)


def test_the_last_word_of_each_record() -> None:
    m = Module()
    step = Step(PLAN)
    last = Signal(4)
    m.d.comb += last.eq(last_words(PLAN, step))

    async def bench(ctx):
        for job, running, at, wanted in (
            (Job.INERTIAL, 0, 0, 7),
            (Job.COUNTS, 0, 0, 2),
            (Job.HEADING, 1, 1, 2),
            (Job.FILTER, 0, 0, 3),
            (Job.FILTER, 1, 0, 3),
            (Job.FILTER, 1, 1, 6),
        ):
            ctx.set(step.job, job)
            ctx.set(step.running, running)
            ctx.set(step.step, at)
            assert ctx.get(last) == wanted, (job, running, at)

    comb(m, bench)
