"""Programs that take turns on one simulated core."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.core import build_shared_core
from boresight.model.words.interpreter import Interpreter
from boresight.sim.rtl.cosim import CocotbSimulation
from boresight.sim.rtl.harness import CompiledSimulation
from boresight.sim.rtl.replay import BusWrite
from boresight.sim.rtl.sharing import completed, random_turns, rounds, run_in_turns
from boresight.sim.rtl.simulators import available
from tests.support.random_program import random_inputs, random_program


@pytest.mark.parametrize("counts", [(5,), (100, 3, 0), (40, 40, 40, 40)])
def test_deal_gives_every_record_once_and_in_order(counts):
    turns = random_turns(counts, seed=3, longest=7)
    assert turns == random_turns(counts, seed=3, longest=7)
    assert all(1 <= t.stop - t.start <= 7 for t in turns)
    for number, count in enumerate(counts):
        records = [k for t in turns if t.number == number for k in range(t.start, t.stop)]
        assert records == list(range(count))
    if len(counts) == 4:
        assert random_turns(counts, seed=4, longest=7) != turns
        owners = [t.number for t in turns]
        assert sum(a != b for a, b in zip(owners, owners[1:], strict=False)) > 10


@pytest.mark.parametrize(
    ("config", "word", "count", "simulator"),
    [("small", 32, 4, "icarus"), ("fast", 32, 3, "verilator"), ("fast-1024", 32, 2, "verilator")],
)
def test_random_programs_in_turns(config, word, count, simulator):
    """Words, flags and cycles of each program are those of the program alone."""
    programs = [  # with records of different lengths, in and out
        random_program(k, word=word, n_states=4, n_inputs=5 - k, n_outputs=1 + k)
        for k in range(count)
    ]
    programs = [replace(p, table_memory=programs[0].table_memory) for p in programs]
    core = build_shared_core(programs, config, restarts=0)
    if not available(simulator):
        pytest.skip(f"needs {simulator}")
    bench = CocotbSimulation if simulator == "icarus" else CompiledSimulation
    simulation = bench(core)
    most = 16 if simulator == "icarus" else 30
    streams = [np.array(random_inputs(p, k, most + k)) for k, p in enumerate(programs)]
    for stall in (0, 5):
        runs = run_in_turns(simulation, streams, seed=stall, stall=stall, longest=5)
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
    run = bench(one).run(stream, bus_writes=[BusWrite(9, address, 12345)])
    assert np.array_equal(run.outputs, np.concatenate([first, second])[:, :, 0])
    assert (run.interval_cycles == one.schedule.interval).all()


def test_rounds_of_records_stay_the_same_when_streams_are_cut():
    turns = rounds((5, 3, 4))
    assert sorted((t.number, t.start, t.stop) for t in turns) == [
        (number, k, k + 1) for number, count in enumerate((5, 3, 4)) for k in range(count)
    ]
    assert [t.start for t in turns] == sorted(t.start for t in turns)
    assert len({tuple(t.number for t in turns[k : k + 3]) for k in (0, 3, 6)}) > 1
    for most in (1, 2, 4):
        cut = rounds([min(most, n) for n in (5, 3, 4)])
        assert cut == [t for t in turns if t.start < most]


def test_completed_counts_the_turns_before():
    counts = (5, 3, 4)
    for number in range(3):
        done = completed(counts, number)
        before = [0, 0, 0]
        seen = []
        for turn in rounds(counts):
            if turn.number == number:
                seen.append(list(before))
            before[turn.number] += 1
        assert np.array(seen).T.tolist() == [row.tolist() for row in done]
