"""What any bench is asked for: records, programs, cycles after which it hangs."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.gateware.core import build_shared_core
from boresight.gateware.registers.core import PROGRAM
from boresight.sim.rtl.replay import (
    Batch,
    BusWrite,
    RegisterWrite,
    ReplayFailed,
    RtlRun,
    RtlSimulation,
)
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.random_program import random_programs

WRITES = (RegisterWrite(0, 5, None, 7),)


class Hung(RtlSimulation):
    """A bench that gives no result."""

    def _replay(self, batch: Batch) -> RtlRun:
        raise ReplayFailed("verilator: update 0 of 1 did not complete", WRITES)


@pytest.fixture(scope="module")
def simulation() -> Hung:
    """Of the second of two programs."""
    return Hung(build_shared_core(random_programs(1, 2, word=18), "small", restarts=0).select(1))


def test_the_selected_program(simulation: Hung) -> None:
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


def test_no_result(simulation: Hung) -> None:
    """To find out why, the register writes alone."""
    inputs = np.zeros((1, 9), dtype=np.int64)
    with pytest.raises(SimulationFailed, match="^verilator: update 0 of 1 did not complete$"):
        simulation.run(inputs)
    run = simulation.run(inputs, allow_unknown=True)
    assert len(run.outputs) == 0 and run.writes == WRITES


def test_nothing_to_compare(simulation: Hung) -> None:
    with pytest.raises(SimulationFailed, match="^nothing to compare: no input records$"):
        simulation.run(np.zeros((0, 9), dtype=np.int64))
