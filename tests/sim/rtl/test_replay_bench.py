"""Benches of one core: C++, cocotb, and what decides their builds."""

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.attitude.complementary import Complementary
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.rtl.cosim import CocotbSimulation
from boresight.sim.rtl.harness import CompiledSimulation, CoreProcess
from boresight.sim.rtl.memories import split_memories
from boresight.sim.rtl.replay import (
    Batch,
    BusWrite,
    RegisterWrite,
    ReplayFailed,
    Reset,
    RtlRun,
    RtlSimulation,
)
from boresight.sim.rtl.sharing import Rounds, Turn, completed, random_turns, run_in_turns
from boresight.sim.rtl.simulators import SimulationFailed, available
from tests.support.random_program import random_inputs, random_program, random_programs

# --------------------------------------------------------------------------------------------------
# two benches for one core, C++ and cocotb: the same words, flags, cycles and register writes


def _random() -> tuple[Core, list[IntArray]]:
    """Two programs, two lanes."""
    programs = random_programs(5, 2, word=24)
    streams = [np.array(random_inputs(p, k, 12 + k)) for k, p in enumerate(programs)]
    return build_shared_core(programs, "fast"), streams


def _recorded() -> tuple[Core, list[IntArray]]:
    """A filter on a bundled log."""
    build = Build(Complementary())
    return build.core, [log.inputs[:10] for log in recorded(build)]


def _runs(simulation: RtlSimulation, streams: list[IntArray]) -> list[RtlRun]:
    """With pauses and without, in turns, and with the register writes of an update."""
    return [
        *run_in_turns(simulation, streams, longest=3),
        *run_in_turns(simulation, streams, stall=7, longest=3),
        simulation.run(streams[0], stall=8, trace=5),
    ]


@pytest.mark.skipif(not available("icarus"), reason="needs icarus")
@pytest.mark.parametrize("what", [_random, _recorded])
def test_cycle_for_cycle_the_same(what) -> None:
    core, streams = what()
    cocotb, compiled = (
        _runs(simulation, streams)
        for simulation in (CocotbSimulation(core), CompiledSimulation(core))
    )
    for item, other in zip(cocotb, compiled, strict=True):
        for name in ("outputs", "saturated", "latency_cycles", "interval_cycles"):
            assert np.array_equal(getattr(item, name), getattr(other, name)), name
    assert cocotb[-1].writes == compiled[-1].writes and len(compiled[-1].writes) > 1


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
    outputs = CompiledSimulation(core).run(inputs).outputs
    assert (outputs != wanted[:, :, 0]).all()


@pytest.mark.skipif(not available("icarus"), reason="needs icarus")
def test_an_unknown_value_is_an_error_in_icarus(doctored) -> None:
    core, inputs = doctored
    message = r"^icarus: unknown value \(X\): out_payload = 1X{18}, record 0, cycle \d+$"
    with pytest.raises(SimulationFailed, match=message):
        CocotbSimulation(core).run(inputs)


# -- the C++ bench: batches of any size, what counts as broken, a process that dies ---------------
# Compared with cocotb above; test_random_rtl.py and the turns below compare it with the model.


@pytest.fixture(scope="module")
def simulation() -> CompiledSimulation:
    """Of the second of two programs."""
    core = build_shared_core(random_programs(1, 2, word=18), "small")
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


def _words(*parts: list[int]) -> BytesIO:
    """Results of a bench: each part behind its length."""
    packed = (
        len(p).to_bytes(8, sys.byteorder) + np.array(p, dtype=np.int32).tobytes() for p in parts
    )
    return BytesIO(b"".join(packed))


def test_a_reset_between_records() -> None:
    """As `harness.cpp` has it; the words that an update gave before it came count."""
    two, inputs = np.array([2, 2]), np.array([[1, 2], [3, 4]])
    batch = Batch(inputs, two - [1, 0], two, [BusWrite(0, 5, 6), Reset(0, 7)], 0, -1, limit=9)
    assert batch.packed() == (
        np.array([2, 2, 0, -1, 9], dtype=np.int64).tobytes()
        + np.array([1, 2, 1, 3, 4, 0, 5, 6, 0, -1, 7], dtype=np.int32).tobytes()
    )
    results = _words([1, 0, -2, 2, 1, 5], [7, 8, 9], [3, 4, 5], [])
    run = batch.result(results.read, word=18, tool="x")
    assert run.outputs.tolist() == [[7, 0], [8, 9]]
    assert run.latency_cycles.tolist() == [[4, 0], [5, 6]]
    assert run.interval_cycles.tolist() == [-2, 5]
    assert run.saturated.tolist() == [False, True]
    lost = _words([1, 0, 4], [7], [3], [])
    with pytest.raises(ReplayFailed, match="^x: unknown value$"):
        batch.result(lost.read, word=18, tool="x", fault="unknown value")


def test_register_writes_of_known_and_of_unknown_words() -> None:
    """Known words have the bits of the register, also of register 0."""
    one = np.ones(1, dtype=np.int64)
    batch = Batch(one[:, None], n_in=one, n_out=one, bus_writes=(), stall=0, trace=0, limit=9)
    packed = _words([1, 0, 5], [7], [3], [0, 0, -1, 2, 1, -1, 4, 3])
    run = batch.result(packed.read, word=18, tool="x")
    assert run.writes == (RegisterWrite(0, 0, 2**18 - 1, 2), RegisterWrite(1, -1, None, 3))
    assert run.latency_cycles.tolist() == [[4]]


def test_a_process_that_has_ended(simulation: CompiledSimulation, process: CoreProcess) -> None:
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


# -- memory contents taken out of the Verilog -----------------------------------------------------


@pytest.mark.parametrize("config", ["small", "fast"])
def test_cores_of_one_machine_differ_in_memories_only(config):
    cores = [build_core(random_program(seed), config) for seed in (1, 2)]
    (a, files_a), (b, files_b) = (split_memories(c.verilog(instances=False)) for c in cores)
    assert a == b
    assert files_a.keys() == files_b.keys()
    assert files_a["rom0.hex"] != files_b["rom0.hex"]


def test_words_survive():
    core = build_core(random_program(3), "small")
    _, files = split_memories(core.verilog(instances=False))
    words = [int(x, 16) for x in files["rom0.hex"].split()]
    assert (words,) == core.image.hardware_rom(core.machine)
    operands = [int(x, 16) for x in files["b0.hex"].split()]
    assert operands == list(core.image.registers) + list(core.image.tables)


def test_no_core_is_refused():
    with pytest.raises(ValueError, match=r"^the Verilog must have initialised memories, not none$"):
        split_memories("module x; endmodule\n")


# -- programs that take turns on one simulated core -----------------------------------------------


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
    core = build_shared_core(programs, config)
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
    part, stream = core.select(number), streams[number]
    name, address = next(iter(part.parameter_addresses.items()))
    model = Interpreter(programs[number])
    first, _ = model.run(stream[:9, :, None])
    model.params[programs[number].find(name)] = 12345
    second, _ = model.run(stream[9:, :, None])
    run = bench(part).run(stream, bus_writes=[BusWrite(9, address, 12345)])
    assert np.array_equal(run.outputs, np.concatenate([first, second])[:, :, 0])
    assert (run.interval_cycles == part.schedule.interval).all()


def test_turns_of_all_lengths():
    turns = random_turns([400, 0, 300], seed=3, longest=4)
    assert {turn.stop - turn.start for turn in turns} == {1, 2, 3, 4}
    assert {turn.number for turn in turns} == {0, 2} and turns != random_turns([400, 0, 300])


def test_each_program_has_its_turns_and_its_results():
    """Numbers that no program has are written, too, before its own records begin."""
    programs = random_programs(1, 2, n_ops=6)
    parts = [SimpleNamespace(program=replace(p, outputs=p.outputs[:1])) for p in programs]
    parts[1] = SimpleNamespace(program=replace(programs[1], outputs=(3, 4)))
    streams = [np.arange(60)[:, None], np.arange(100, 180).reshape(40, 2)]
    seen = {}

    def replay(words, *, numbers, stall, bus_writes):
        seen.update(words=words, numbers=numbers, stall=stall, writes=bus_writes)
        outputs = np.stack([words[:, 0], -words[:, 0], words[:, 0]], axis=1)
        return RtlRun(outputs, words[:, 0] % 2 > 0, outputs + 7, words[:, 0] + 9)

    simulation = SimpleNamespace(core=SimpleNamespace(parts=parts))
    turns = [Turn(1, 0, 30), Turn(0, 0, 60), Turn(1, 30, 40)]
    runs = run_in_turns(simulation, streams, turns=turns, stall=5, replay=replay)
    assert seen["numbers"].tolist() == [1] * 30 + [0] * 60 + [1] * 10 and seen["stall"] == 5
    assert seen["words"][30].tolist() == [0, 0] and seen["words"][0].tolist() == [100, 101]
    own = [w for w in seen["writes"] if w.word in (0, 1)]
    assert own == [BusWrite(at, PROGRAM, k) for at, k in ((0, 1), (30, 0), (90, 1))]
    for run, stream, n in zip(runs, streams, (1, 2), strict=True):
        first = stream[:, 0]
        assert run.outputs.tolist() == np.stack([first, -first], axis=1)[:, :n].tolist()
        assert np.array_equal(run.latency_cycles, run.outputs + 7)
        assert np.array_equal(run.interval_cycles, first + 9)
        assert np.array_equal(run.saturated, first % 2 > 0)
    run_in_turns(simulation, streams, longest=1, replay=replay)
    wrong = [w for w in seen["writes"] if w.word not in (0, 1)]
    assert {w.word for w in wrong} == {2, -1} and {w.address for w in wrong} == {PROGRAM}
    assert 10 < len(wrong) < 50  # of 100 turns


def test_rounds_of_records_stay_the_same_when_streams_are_cut():
    turns = Rounds().piece((5, 3, 4))
    assert sorted((t.number, t.start, t.stop) for t in turns) == [
        (number, k, k + 1) for number, count in enumerate((5, 3, 4)) for k in range(count)
    ]
    assert [t.start for t in turns] == sorted(t.start for t in turns)
    assert len({tuple(t.number for t in turns[k : k + 3]) for k in (0, 3, 6)}) > 1
    for most in (1, 2, 4):
        cut = Rounds().piece([min(most, n) for n in (5, 3, 4)])
        assert cut == [t for t in turns if t.start < most]
    rounds, parts = Rounds(), list[Turn]()
    for start, counts in ((0, (2, 2, 2)), (2, (2, 1, 2)), (4, (1, 0, 0))):
        parts += [Turn(t.number, t.start + start, t.stop + start) for t in rounds.piece(counts)]
    assert parts == turns


def test_completed_counts_the_turns_before():
    turns = Rounds().piece((5, 3, 4))
    for number in range(3):
        done = completed(turns, 3, number)
        before = [0, 0, 0]
        seen = []
        for turn in turns:
            if turn.number == number:
                seen.append(list(before))
            before[turn.number] += 1
        assert np.array(seen).T.tolist() == [row.tolist() for row in done]
