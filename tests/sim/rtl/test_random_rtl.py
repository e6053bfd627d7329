"""Random programs through the whole compiler: interpreter, C and RTL give the same words."""

import tempfile

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.core import build_core
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.rtl.cosim import CocotbSimulation
from boresight.sim.rtl.harness import CompiledSimulation
from boresight.sim.rtl.simulators import available
from tests.support.random_program import random_program

VERILATOR, ICARUS = (
    pytest.mark.skipif(not available(name), reason=f"needs {name}")
    for name in ("verilator", "icarus")
)
#: Machine, simulator, programs, updates of each.
RUNS = [
    pytest.param("small", 32, "verilator", range(0, 4), 40, marks=VERILATOR),
    pytest.param("fast", 32, "verilator", range(12, 16), 40, marks=VERILATOR),
    pytest.param("small-1024", 32, "verilator", range(40, 41), 40, marks=VERILATOR),
    pytest.param("small-2048", 32, "verilator", range(41, 43), 40, marks=VERILATOR),
    pytest.param("small", 18, "icarus", range(24, 26), 20, marks=ICARUS),
    pytest.param("fast", 24, "icarus", range(28, 30), 20, marks=ICARUS),
    pytest.param(
        "small", 32, "verilator", range(100, 200), 40, marks=[VERILATOR, pytest.mark.soak]
    ),
    pytest.param("fast", 32, "verilator", range(200, 300), 40, marks=[VERILATOR, pytest.mark.soak]),
    pytest.param("fast", 18, "verilator", range(300, 330), 40, marks=[VERILATOR, pytest.mark.soak]),
    pytest.param("small", 24, "icarus", range(330, 345), 40, marks=[ICARUS, pytest.mark.soak]),
    pytest.param("fast", 32, "icarus", range(345, 360), 40, marks=[ICARUS, pytest.mark.soak]),
    *(
        pytest.param(c, 32, "verilator", range(360, 390), 40, marks=[VERILATOR, pytest.mark.soak])
        for c in ("small-1024", "fast-1024", "small-2048", "fast-2048")
    ),
]


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


@pytest.fixture
def odd(tmp_path, monkeypatch):
    """Temporary files, and what is quickly built, in a folder that a shell cannot take."""
    folder = tmp_path / "my fpga übung & (more)"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.parametrize(
    ("config", "word", "simulator", "seeds", "steps"),
    RUNS,
    ids=lambda x: f"from{x.start}" if isinstance(x, range) else str(x),
)
def test_interpreter_c_and_rtl_agree(config, word, simulator, seeds, steps, odd):
    compared = 0
    for seed in seeds:
        program = random_program(seed, word=word)
        if not program.inputs:
            continue
        inputs = inputs_for(program, steps, seed)
        wanted, flags = reference(program, inputs)
        c_words, c_flags = CModel(program).update(inputs)
        assert np.array_equal(c_words, wanted), f"seed {seed}: C"
        assert np.array_equal(c_flags, flags), f"seed {seed}: C saturation"
        core = build_core(program, config, restarts=0)
        icarus = simulator == "icarus"
        simulation = CocotbSimulation(core, cache=odd) if icarus else CompiledSimulation(core)
        for stall in (0, seed + 1):
            run = simulation.run(inputs, stall=stall)
            assert np.array_equal(run.outputs, wanted), f"seed {seed}: RTL, stall {stall}"
            assert np.array_equal(run.saturated, flags), f"seed {seed}: RTL saturation"
            if stall == 0:
                assert (run.latency_cycles == np.array(core.schedule.latencies)).all()
                assert (run.interval_cycles == core.schedule.interval).all()
        compared += len(inputs)
    assert compared >= steps * len(seeds) // 2
