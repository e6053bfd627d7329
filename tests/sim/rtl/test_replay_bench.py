"""The bench of a core in both simulators."""

import re
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.model.attitude.complementary import Complementary
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.sim.levels.build import Build
from boresight.sim.levels.rtl import recorded, run_in_turns
from boresight.sim.rtl.simulation import BusWrite, CoreProcess, RtlRun, RtlSimulation
from boresight.sim.rtl.simulators import SimulationFailed, available
from tests.support.random_program import random_inputs, random_program, random_programs

# --------------------------------------------------------------------------------------------------
# both simulators: the same words, flags, cycles and register writes


def _random() -> tuple[Core, list[IntArray]]:
    """Two programs, two lanes."""
    programs = random_programs(5, 2, word=24)
    streams = [np.array(random_inputs(p, k, 8 + k)) for k, p in enumerate(programs)]
    return build_shared_core(programs, "fast"), streams


def _recorded() -> tuple[Core, list[IntArray]]:
    """A filter on a bundled log."""
    build = Build(Complementary())
    return build.core, [log.inputs[:4] for log in recorded(build)]


def _runs(simulation: RtlSimulation, streams: list[IntArray]) -> list[RtlRun]:
    """With pauses and without, in turns, and with the register writes of an update."""
    return [
        *run_in_turns(simulation, streams, longest=3),
        *run_in_turns(simulation, streams, stall=7, longest=3),
        simulation.run(streams[0], stall=8),
    ]


@pytest.mark.skipif(not available("icarus"), reason="needs icarus")
@pytest.mark.parametrize("what", [_random, _recorded])
def test_cycle_for_cycle_the_same(what) -> None:
    core, streams = what()
    icarus, compiled = (
        _runs(simulation, streams)
        for simulation in (RtlSimulation(core, "icarus"), RtlSimulation(core))
    )
    for item, other in zip(icarus, compiled, strict=True):
        for name in ("outputs", "saturated", "latency_cycles", "interval_cycles"):
            assert np.array_equal(getattr(item, name), getattr(other, name)), name


@pytest.fixture
def doctored(monkeypatch: pytest.MonkeyPatch) -> tuple[Core, IntArray]:
    """A core whose output depends on a register without a start value, and its records."""
    sound, payload = Core.verilog, re.compile(r"(assign o__payload = \{ .*, a__0) \};")
    junk = r"reg [17:0] junk; \1 ^ junk };"
    monkeypatch.setattr(Core, "verilog", lambda *a, **k: payload.sub(junk, sound(*a, **k)))
    program = random_programs(1, 1, word=18)[0]
    return build_core(program, "small"), np.array(random_inputs(program, 3, 2))


def test_an_unknown_value_is_random_in_verilator(doctored) -> None:
    core, inputs = doctored
    wanted, _ = Interpreter(core.program).run(inputs[:, :, None])
    outputs = RtlSimulation(core).run(inputs).outputs
    assert (outputs != wanted[:, :, 0]).all()


@pytest.mark.skipif(not available("icarus"), reason="needs icarus")
def test_an_unknown_value_is_an_error_in_icarus(doctored) -> None:
    core, inputs = doctored
    message = r"^icarus: unknown value \(X\): out_payload = 1x{18}, record 0, cycle \d+$"
    with pytest.raises(SimulationFailed, match=message):
        RtlSimulation(core, "icarus").run(inputs)


# -- batches of any size, what counts as broken, a process that dies ------------------------------


@pytest.fixture(scope="module")
def simulation() -> RtlSimulation:
    """Of the second of two programs."""
    core = build_shared_core(random_programs(1, 2, word=18), "small")
    return RtlSimulation(core.select(1))


@pytest.fixture
def process(simulation: RtlSimulation) -> Iterator[CoreProcess]:
    with closing(simulation.power_on()) as process:
        yield process


def test_batches_follow_each_other(simulation: RtlSimulation, process: CoreProcess) -> None:
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


def test_what_is_no_result(simulation: RtlSimulation) -> None:
    """Words missing, words too many, too few cycles."""
    inputs = np.array(random_inputs(simulation.core.program, 3, 3))
    batch = simulation.batch(inputs)
    n, interval = len(simulation.core.program.outputs), simulation.core.schedule.interval
    for changed, message in (
        ({"n_out": batch.n_out + [0, 0, 1]}, f"update 2 gave {n} output words, {n + 1} expected"),
        ({"n_out": batch.n_out + [0, 1, 0]}, f"update 1 gave {n} output words, {n + 1} expected"),
        ({"n_out": batch.n_out - [0, 0, 1]}, f"update 2 gave {n} output words, {n - 1} expected"),
        ({"limit": 2 * interval}, "update 1 of 3 did not complete"),
    ):
        with (
            closing(simulation.power_on()) as process,
            pytest.raises(SimulationFailed, match=f"^verilator: {message}"),
        ):
            process.replay(replace(batch, **changed))


def test_a_process_that_has_ended(simulation: RtlSimulation, process: CoreProcess) -> None:
    batch = simulation.batch(np.array(random_inputs(simulation.core.program, 3, 1)))
    process.replay(batch)
    process.process.kill()
    process.process.wait()
    message = "^verilator run failed: the process ended with exit code -9"
    with pytest.raises(SimulationFailed, match=message):
        process.replay(batch)
    folder = process.folder
    assert folder.is_dir()
    process.close()
    assert not folder.exists()


# -- programs that take turns on one simulated core -----------------------------------------------


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
    core = build_shared_core(programs, config)
    if not available(simulator):
        pytest.skip(f"needs {simulator}")
    simulation = RtlSimulation(core, simulator)
    most = 10 if simulator == "icarus" else 30
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
    part, stream = core.select(number), streams[number]
    name, address = next(iter(part.parameter_addresses.items()))
    model = Interpreter(programs[number])
    first, _ = model.run(stream[:9, :, None])
    model.params[programs[number].find(name)] = 12345
    second, _ = model.run(stream[9:, :, None])
    run = RtlSimulation(part, simulator).run(stream, bus_writes=[BusWrite(9, address, 12345)])
    assert np.array_equal(run.outputs, np.concatenate([first, second])[:, :, 0])
    assert (run.interval_cycles == part.schedule.interval).all()


@pytest.mark.parametrize(("n_inputs", "n_outputs"), [(16, 1), (1, 16)])
def test_pauses_are_made_on_both_sides(n_inputs: int, n_outputs: int) -> None:
    """16 words wait longer than one word can."""
    program = random_program(1, word=18, n_inputs=n_inputs, n_outputs=n_outputs)
    core = build_core(program, "small")
    run = RtlSimulation(core).run(np.array(random_inputs(program, 1, 20)), stall=3)
    assert (run.interval_cycles - core.schedule.interval).mean() > 5.0
