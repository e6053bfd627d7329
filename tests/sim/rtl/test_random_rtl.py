"""Random programs through the whole compiler: interpreter, C and RTL give the same words."""

import itertools
import tempfile

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.core import build_core
from boresight.gateware.machine import Machine
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.rtl.simulation import RtlSimulation
from boresight.sim.rtl.simulators import available
from tests.support.random_case import Case, check
from tests.support.random_program import random_program, with_ranges

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
    pytest.param("small", 18, "icarus", range(24, 25), 20, marks=ICARUS),
    pytest.param("fast", 24, "icarus", range(28, 29), 20, marks=ICARUS),
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
    words = np.where(extreme, rng.choice([low, high, 0, -1, 1], words.shape), words)
    first, last = program.input_ranges
    ends = np.clip(rng.choice([first, last, first - 1, last + 1], steps), low, high)
    return np.where(rng.random(words.shape) < 0.5, ends, words)


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
def test_interpreter_c_and_rtl_agree(config, word, simulator, seeds, steps, odd, monkeypatch):
    if simulator == "icarus":
        monkeypatch.setenv("XDG_CACHE_HOME", str(odd))
    compared = 0
    for seed in seeds:
        program = with_ranges(random_program(seed, word=word), seed)
        if not program.inputs:
            continue
        inputs = inputs_for(program, steps, seed)
        wanted, flags = reference(program, inputs)
        beyond, model = program.beyond(inputs), CModel(program)
        c_words, c_flags = model.update(inputs)
        assert np.array_equal(c_words, wanted), f"seed {seed}: C"
        assert np.array_equal(c_flags, flags), f"seed {seed}: C saturation"
        assert np.array_equal(model.beyond, beyond), f"seed {seed}: C ranges"
        core = build_core(program, config)
        simulation = RtlSimulation(core, simulator)
        for stall in (0, seed + 1):
            run = simulation.run(inputs, stall=stall)
            assert np.array_equal(run.outputs, wanted), f"seed {seed}: RTL, stall {stall}"
            assert np.array_equal(run.saturated, flags), f"seed {seed}: RTL saturation"
            assert np.array_equal(run.beyond, beyond), f"seed {seed}: RTL ranges"
            if stall == 0:
                assert (run.latency_cycles == np.array(core.schedule.latencies)).all()
                assert (run.interval_cycles == core.schedule.interval).all()
        compared += len(inputs)
    assert compared >= steps * len(seeds) // 2


@VERILATOR
@pytest.mark.parametrize(
    ("config", "seeds"),
    [
        ("small", range(3)),
        ("fast", range(3, 6)),
        pytest.param("small", range(1000, 1100), marks=pytest.mark.soak),
        pytest.param("fast", range(1100, 1200), marks=pytest.mark.soak),
    ],
)
def test_resets_in_any_cycle(config, seeds):
    """The update is abandoned, or complete in its last cycle; the next ones know nothing of it."""
    for seed in seeds:
        case = Case(
            seed,
            config,
            word=32,
            programs=1 + seed % 3,
            n_ops=10,
            urgent=0,
            updates=30,
            stall=seed // 3 % 2,
            rtl=True,
            resets=4,
        )
        assert not (wrong := check(case)), f"{case}: {wrong}"


def from_each_state(program: Program, inputs: IntArray, model: CModel) -> None:
    """One update of the interpreter from each state that C went through: C's words and next state.

    With equal first states that is the run of both, by induction.
    """
    first = model.states[0].astype(np.int64)
    words, flags, states = model.trajectory(inputs)
    machine = Interpreter(program, len(inputs))
    machine.states = np.vstack([first[None], states[:-1]]).T
    wanted, saturated = machine.update(inputs.T)
    assert np.array_equal(words.T, wanted) and np.array_equal(flags, saturated)
    assert np.array_equal(states.T, machine.states)


def drawn_programs(words: tuple[int, ...], first: int = 0):
    """Random programs with inputs, without end."""
    for seed in itertools.count(first):
        program = random_program(seed, word=words[seed % len(words)], n_ops=5 + seed % 36)
        if program.inputs:
            yield seed, program


@pytest.mark.parametrize("updates", [10**5, pytest.param(10**8, marks=pytest.mark.soak)])
def test_many_updates_of_interpreter_and_c(updates):
    """``-s`` prints how many there were."""
    done, each = 0, min(updates // 20, 10**5)
    for seed, program in drawn_programs(tuple(range(18, 33)), 1000):
        model = CModel(program)
        assert model.states[0].tolist() == [program.values[s].initial for s, _ in program.states]
        for part in range(4):
            from_each_state(program, inputs_for(program, each, 10 * seed + part), model)
            done += each
        if done >= updates:
            break
    print(f"{done:,} updates of {seed - 999} programs, interpreter and C: 0 differ")


@pytest.mark.soak
@pytest.mark.skipif(not available("verilator"), reason="needs verilator")
@pytest.mark.parametrize("depth", Machine.DEPTHS)
@pytest.mark.parametrize("config", ["small", "fast"])
def test_many_updates_in_rtl(config, depth):
    """125,000 on each machine, with pauses of both streams in every other program."""
    config = f"{config}-d{depth}".removesuffix("-d7")
    done, each = 0, 25_000
    for seed, program in drawn_programs((18, 24, 32), 2000):
        inputs = inputs_for(program, each, seed)
        wanted, flags = CModel(program).update(inputs)
        run = RtlSimulation(build_core(program, config)).run(inputs, stall=(seed + 1) * (seed % 2))
        assert np.array_equal(run.outputs, wanted) and np.array_equal(run.saturated, flags), seed
        done += each
        if done >= 125_000:
            break
    print(f"{config}: {done:,} updates, C and RTL: 0 differ")
