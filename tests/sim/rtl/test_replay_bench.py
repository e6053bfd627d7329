"""Two benches for one core, C++ and cocotb: the same words, flags, cycles and register writes."""

from __future__ import annotations

import re

import numpy as np
import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.model.estimators.complementary import Complementary
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.rtl.cosim import CocotbSimulation
from boresight.sim.rtl.harness import CompiledSimulation
from boresight.sim.rtl.replay import RtlRun, RtlSimulation
from boresight.sim.rtl.sharing import run_in_turns
from boresight.sim.rtl.simulators import SimulationFailed, available
from tests.support.random_program import random_inputs, random_programs


def _random() -> tuple[Core, list[IntArray]]:
    """Two programs, two lanes."""
    programs = random_programs(5, 2, word=24)
    streams = [np.array(random_inputs(p, k, 12 + k)) for k, p in enumerate(programs)]
    return build_shared_core(programs, "fast", restarts=0), streams


def _recorded() -> tuple[Core, list[IntArray]]:
    """A filter on a bundled log."""
    build = Build(Complementary(), restarts=0)
    return build.core, [log.inputs[:10] for log in recorded(build)]


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
    assert cocotb[-1].writes == compiled[-1].writes and len(compiled[-1].writes) > 1


@pytest.fixture
def doctored(monkeypatch: pytest.MonkeyPatch) -> tuple[Core, IntArray]:
    """A core whose output depends on a register without a start value, and its records."""
    sound, payload = Core.verilog, re.compile(r"(assign o__payload = \{ .*, a__0) \};")
    junk = r"reg [17:0] junk; \1 ^ junk };"
    monkeypatch.setattr(Core, "verilog", lambda *a, **k: payload.sub(junk, sound(*a, **k)))
    program = random_programs(1, 1, word=18)[0]
    return build_core(program, "small", restarts=0), np.array(random_inputs(program, 3, 2))


def test_an_unknown_value_is_random_in_verilator(doctored) -> None:
    core, inputs = doctored
    wanted, _ = Interpreter(core.program).run(inputs[:, :, None])
    outputs = CompiledSimulation(core).run(inputs).outputs
    assert (outputs != wanted[:, :, 0]).all()


@pytest.mark.skipif(not available("icarus"), reason="needs icarus")
def test_an_unknown_value_is_an_error_in_icarus(doctored) -> None:
    core, inputs = doctored
    message = r"^icarus: unknown value \(X\): out_payload = 1X{18}, record 0, cycle \d+$"
    with pytest.raises(SimulationFailed, match=message):
        CocotbSimulation(core).run(inputs)
