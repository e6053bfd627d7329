"""Random programs through the whole compiler: interpreter, C and RTL give the same words."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.core import build_core
from boresight.model.fixed import IntArray
from boresight.model.interpreter import Interpreter
from boresight.model.program import Program
from boresight.sim.cosim import RtlSimulation
from boresight.sim.simulators import available
from tests.support.random_program import random_program

RUNS = [("small", 32, "verilator", range(0, 12)), ("fast", 32, "verilator", range(12, 24))]
if available("icarus"):
    RUNS += [("small", 18, "icarus", range(24, 28)), ("fast", 24, "icarus", range(28, 32))]


def inputs_for(program: Program, steps: int, seed: int) -> IntArray:
    rng = np.random.default_rng(seed)
    low, high = program.arithmetic.min_int, program.arithmetic.max_int
    words = rng.integers(low, high + 1, (steps, len(program.inputs)))
    small = rng.integers(0, 2, words.shape)
    words >>= rng.integers(0, program.arithmetic.word, words.shape) * small
    extreme = rng.random(words.shape) < 0.1
    return np.where(extreme, rng.choice([low, high, 0, -1, 1], words.shape), words)


def reference(program: Program, inputs: IntArray):
    out, saturated = Interpreter(program).run(inputs[:, :, None])
    return out[:, :, 0], saturated[:, 0]


@pytest.mark.parametrize(
    ("config", "word", "simulator", "seeds"),
    RUNS,
    ids=lambda x: str(x) if isinstance(x, (str, int)) else "",
)
def test_interpreter_c_and_rtl_agree(config, word, simulator, seeds):
    compared = 0
    for seed in seeds:
        program = random_program(seed, word=word)
        if not program.inputs:
            continue
        inputs = inputs_for(program, 40, seed)
        wanted, flags = reference(program, inputs)
        c_words, c_flags = CModel(program).update(inputs)
        assert np.array_equal(c_words, wanted), f"seed {seed}: C"
        assert np.array_equal(c_flags, flags), f"seed {seed}: C saturation"
        core = build_core(program, config, restarts=0)
        simulation = RtlSimulation(
            core.verilog(instances=False),
            word=word,
            n_inputs=len(program.inputs),
            n_outputs=len(program.outputs),
            lanes=core.machine.lanes,
            simulator=simulator,
        )
        for stall in (0, seed + 1):
            run = simulation.run(inputs, max_interval=core.schedule.interval + 64, stall=stall)
            assert np.array_equal(run.outputs, wanted), f"seed {seed}: RTL, stall {stall}"
            assert np.array_equal(run.saturated, flags), f"seed {seed}: RTL saturation"
            if stall == 0:
                assert (run.latency_cycles == np.array(core.schedule.latencies)).all()
                assert (run.interval_cycles == core.schedule.interval).all()
        compared += len(inputs)
    assert compared >= 100
