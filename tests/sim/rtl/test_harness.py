"""The C++ bench: batches of any size, what counts as broken, a process that dies.

test_replay_bench.py compares it with cocotb, test_random_rtl.py and test_sharing.py with the model.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from boresight.gateware.core import build_shared_core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.interpreter import Interpreter
from boresight.sim.rtl.harness import CompiledSimulation, CoreProcess
from boresight.sim.rtl.replay import BusWrite, ReplayFailed
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.random_program import random_inputs, random_programs


@pytest.fixture(scope="module")
def simulation() -> CompiledSimulation:
    """Of the second of two programs."""
    core = build_shared_core(random_programs(1, 2, word=18), "small", restarts=0)
    return CompiledSimulation(core.select(1))


@pytest.fixture
def process(simulation: CompiledSimulation) -> Iterator[CoreProcess]:
    with simulation.power_on() as process:
        yield process


def test_batches_follow_each_other(simulation: CompiledSimulation, process: CoreProcess) -> None:
    """States live on; the whole in one go gives the same, cycle by cycle."""
    core = simulation.core
    inputs = np.array(random_inputs(core.program, 3, 30))
    wanted, flags = Interpreter(core.program).run(inputs[:, :, None])
    whole = simulation.run(inputs)
    assert np.array_equal(whole.outputs, wanted[:, :, 0])
    assert np.array_equal(whole.saturated, flags[:, 0])
    for start, stop in ((0, 1), (1, 2), (2, 30)):
        piece = process.replay(simulation.batch(inputs[start:stop]))
        for name in ("outputs", "saturated", "latency_cycles", "interval_cycles"):
            assert np.array_equal(getattr(piece, name), getattr(whole, name)[start:stop]), name


def test_what_is_no_result(simulation: CompiledSimulation) -> None:
    """Words missing, words too many, too few cycles; the register writes come nevertheless."""
    inputs = np.array(random_inputs(simulation.core.program, 3, 3))
    batch = simulation.batch(inputs, trace=0)
    n, interval = len(simulation.core.program.outputs), simulation.core.schedule.interval
    writes = simulation.run(inputs, trace=0).writes
    for changed, message in (
        ({"n_out": batch.n_out + [0, 0, 1]}, f"update 2 gave {n} output words, {n + 1} expected"),
        ({"n_out": batch.n_out + [0, 1, 0]}, f"update 1 gave {n} output words, {n + 1} expected"),
        ({"n_out": batch.n_out - [0, 0, 1]}, f"update 2 gave {n} output words, {n - 1} expected"),
        ({"limit": 2 * interval}, "update 1 of 3 did not complete"),
    ):
        with (
            simulation.power_on() as process,
            pytest.raises(ReplayFailed, match=f"^verilator: {message}") as failed,
        ):
            process.replay(replace(batch, **changed))
        assert writes and failed.value.writes == writes


def test_a_process_that_has_ended(simulation: CompiledSimulation, process: CoreProcess) -> None:
    batch = simulation.batch(np.array(random_inputs(simulation.core.program, 3, 1)))
    process.replay(batch)
    process.process.kill()
    process.process.wait()
    message = "^verilator run failed: the process ended with exit code -9"
    with pytest.raises(SimulationFailed, match=message):
        process.replay(batch)
    folder = Path(process.folder.name)
    assert folder.is_dir()
    process.close()
    assert not folder.exists()


def test_the_selected_program(simulation: CompiledSimulation) -> None:
    """It is selected first; its words count; it may take its interval for each record, and more."""
    (first, second), inputs = simulation.core.parts, np.zeros((3, 9), dtype=np.int64)
    batch = simulation.batch(inputs, bus_writes=[BusWrite(1, 3, 5)])
    assert batch.bus_writes == [BusWrite(0, PROGRAM, 1), BusWrite(1, 3, 5)]
    assert batch.n_in.tolist() == 3 * [len(second.program.streamed)]
    assert batch.n_out.tolist() == 3 * [len(second.program.outputs)]
    assert (batch.stall, batch.trace) == (0, -1)
    assert batch.limit == (3 + 4) * second.schedule.interval + 2 * 64 + 1000
    batch = simulation.batch(inputs, np.array([0, 1, 0]), stall=7, trace=2)
    assert batch.n_in.tolist() == [len(p.program.streamed) for p in (first, second, first)]
    assert batch.n_out.tolist() == [len(p.program.outputs) for p in (first, second, first)]
    assert (list(batch.bus_writes), batch.stall, batch.trace) == ([], 7, 2)
    longest = max(first.schedule.interval, second.schedule.interval)
    assert batch.limit == (3 + 4) * longest * 16 + 1000


def test_nothing_to_compare(simulation: CompiledSimulation) -> None:
    with pytest.raises(SimulationFailed, match="^nothing to compare: no input records$"):
        simulation.run(np.zeros((0, 9), dtype=np.int64))
