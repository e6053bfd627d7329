"""Programs that take turns on one simulated core."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boresight.gateware.core import build_shared_core
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.check import simulation_of
from boresight.sim.rtl.cosim import BusWrite
from boresight.sim.rtl.sharing import deal, run_in_turns, selection
from boresight.sim.rtl.simulators import available
from tests.support.random_program import random_inputs, random_programs


@pytest.mark.parametrize("counts", [(5,), (100, 3, 0), (40, 40, 40, 40)])
def test_deal_gives_every_record_once_and_in_order(counts):
    turns = deal(counts, seed=3, longest=7)
    assert turns == deal(counts, seed=3, longest=7)
    assert all(1 <= t.stop - t.start <= 7 for t in turns)
    for number, count in enumerate(counts):
        records = [k for t in turns if t.number == number for k in range(t.start, t.stop)]
        assert records == list(range(count))
    if len(counts) == 4:
        assert deal(counts, seed=4, longest=7) != turns
        owners = [t.number for t in turns]
        assert sum(a != b for a, b in zip(owners, owners[1:], strict=False)) > 10


@pytest.mark.parametrize(
    ("config", "word", "count", "simulator"),
    [("small", 32, 4, "icarus"), ("fast", 32, 3, "verilator")],
)
def test_random_programs_in_turns(config, word, count, simulator):
    """Words, flags and cycles of each program are those of the program alone."""
    programs = random_programs(count, count, word=word, n_ops=30, n_states=4)
    core = build_shared_core(programs, config, restarts=0)
    if not available(simulator):
        pytest.skip(f"needs {simulator}")
    simulation = simulation_of(core, simulator, core.verilog(instances=False))
    streams = [np.array(random_inputs(p, k, 30 + k)) for k, p in enumerate(programs)]
    for stall in (0, 5):
        runs = run_in_turns(core, simulation, streams, seed=stall, stall=stall, longest=5)
        for number, (program, stream, run) in enumerate(zip(programs, streams, runs, strict=True)):
            out, saturated = Interpreter(program).run(stream[:, :, None])
            assert np.array_equal(run.outputs, out[:, :, 0]), f"{number}, stall {stall}"
            assert np.array_equal(run.saturated, saturated[:, 0])
            if not stall:
                plan = core.parts[number].schedule
                assert (run.latency_cycles == np.array(plan.latencies)).all()
                assert (run.interval_cycles == plan.interval).all()
    # And one of them by itself, with a parameter that the host has changed meanwhile.
    number = next(k for k in range(1, count) if core.select(k).parameter_addresses)
    one, stream = core.select(number), streams[number]
    name, address = next(iter(one.parameter_addresses.items()))
    model = Interpreter(programs[number])
    first, _ = model.run(stream[:9, :, None])
    model.params[programs[number].find(name)] = 12345
    second, _ = model.run(stream[9:, :, None])
    run = simulation.run(
        stream,
        max_interval=one.schedule.interval,
        bus_writes=[*selection(one), BusWrite(9, address, 12345)],
    )
    assert np.array_equal(run.outputs, np.concatenate([first, second])[:, :, 0])
    assert (run.interval_cycles == one.schedule.interval).all()


def test_selection():
    core = build_shared_core(random_programs(1, 2), "small", restarts=0)
    assert selection(core.select(1)) == (BusWrite(0, 516, 1),)
    alone = dataclasses.replace(core, parts=core.parts[:1])
    assert selection(alone) == ()
