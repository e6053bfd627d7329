"""Two benches for one core, C++ and cocotb: the same words, flags, cycles and register writes."""

from __future__ import annotations

from operator import attrgetter

import numpy as np
import pytest

from boresight.gateware.core import Core, build_shared_core
from boresight.model.estimators.complementary import Complementary
from boresight.model.words.fixed import IntArray
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.rtl.cosim import CocotbSimulation
from boresight.sim.rtl.harness import CompiledSimulation
from boresight.sim.rtl.replay import RtlRun, RtlSimulation
from boresight.sim.rtl.sharing import run_in_turns
from boresight.sim.rtl.simulators import available
from tests.support.random_program import random_inputs, random_programs


def _random() -> tuple[Core, list[IntArray]]:
    """Two programs, two lanes."""
    programs = random_programs(5, 2, word=24)
    streams = [np.array(random_inputs(p, k, 20 + k)) for k, p in enumerate(programs)]
    return build_shared_core(programs, "fast", restarts=0), streams


def _recorded() -> tuple[Core, list[IntArray]]:
    """A filter on a bundled log."""
    build = Build(Complementary(), restarts=0)
    return build.core, [log.inputs[:20] for log in recorded(build)]


def _runs(simulation: RtlSimulation, streams: list[IntArray]) -> list[RtlRun]:
    """With pauses and without, in turns, and with the register writes of an update."""
    return [
        *run_in_turns(simulation, streams, longest=3),
        *run_in_turns(simulation, streams, stall=7, longest=3),
        simulation.run(streams[0], stall=8, trace=5),
    ]


@pytest.mark.skipif(not available("cocotb"), reason="needs cocotb and a shared libpython")
@pytest.mark.parametrize("what", [_random, _recorded])
def test_cycle_for_cycle_the_same(what) -> None:
    core, streams = what()
    cocotb, compiled = (
        _runs(simulation, streams)
        for simulation in (CocotbSimulation(core, simulator="verilator"), CompiledSimulation(core))
    )
    for one, other in zip(cocotb, compiled, strict=True):
        for name in ("outputs", "saturated", "latency_cycles", "interval_cycles"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
    order = attrgetter("cycle", "lane")
    writes = [sorted(runs[-1].writes, key=order) for runs in (cocotb, compiled)]
    assert writes[0] == writes[1] and len(writes[0]) > 1
