"""The core and its conductor in compiled simulation: words, cycles, writes of the host."""

import random

import numpy as np
import pytest

from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.attitude.system.interface import HEADER, Place
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.core import Core
from boresight.gateware.registers import PROGRAM
from boresight.model.attitude import FILTERS
from boresight.model.nine_axis import INPUTS
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Samples, run_chain
from boresight.sim.levels.registry import interpret
from boresight.sim.records.files import bundled, read_record
from tests.support.attitude.board.shared import odd_board
from tests.support.attitude.conductor_bench import Played, play, sample_command, script_of
from tests.support.attitude.quantise import quantise

STEPS = 60


@pytest.fixture(scope="module")
def cores() -> dict[str, Core]:
    return {config: system_core(FILTERS, config=config) for config in ("small", "fast")}


@pytest.fixture(scope="module")
def conductors(cores) -> dict[str, Conductor]:
    return {config: Conductor(core=core) for config, core in cores.items()}


def samples(kind: int = COUNTS, number: int = 0, steps: int = STEPS, first: int = 0) -> Samples:
    """A cut of the bundled recording, with many lines."""
    whole = quantise(read_record(bundled("synthetic_60s")), kind=kind, number=number, line_hz=500)
    cut = {
        name: getattr(whole, name)[first : first + steps].copy()
        for name in ("stamp", "counts", "line", "values", "restart", "filter")
    }
    cut["line"][0] = NO_LINE
    cut["restart"][0] = True
    return Samples(**cut)


def programs(core: Core) -> list:
    return [part.program for part in core.parts]


def check_words(core: Core, stimulus: Samples, played: Played) -> None:
    chain = run_chain(programs(core), stimulus)
    assert len(played.results) == len(stimulus)
    assert (played.words(Place.INPUTS, 10) == chain.records).all()
    assert (played.words(Place.OUTPUTS, 8) == chain.outputs).all()
    assert (played.words(Place.STAMP, 1)[:, 0] == wrapped(stimulus.stamp)).all()
    assert (played.words(Place.RAWS, 6) >> 16 == stimulus.counts).all()
    used = stimulus.line != NO_LINE
    assert (played.words(Place.LINE, 3)[used] >> 16 == stimulus.values[used]).all()
    header = played.words(Place.HEADER, 1)[:, 0]
    wanted = {
        "number": np.arange(1, len(stimulus) + 1),
        "filter": stimulus.filter,
        "field_used": used,
        "field_counts": stimulus.line == COUNTS,
        "restart": chain.restart,
        "saturated": chain.saturated,
        "restart_asked": stimulus.restart | (np.diff(stimulus.filter, prepend=-1) != 0),
    }
    for field in HEADER:
        assert (field.of(header) == wanted[field.name]).all(), field.name
    assert len(played.named("field_used")) == np.count_nonzero(stimulus.line)
    assert len(played.named("restart")) == np.count_nonzero(chain.restart)
    for name in ("sample_dropped", "field_dropped", "framing"):
        assert not played.named(name)


def wrapped(stamp: IntArray) -> IntArray:
    return (stamp + 2**31) % 2**32 - 2**31


@pytest.mark.parametrize("config", ["small", "fast"])
@pytest.mark.parametrize("number", range(4))
def test_words_and_cycles(config: str, number: int, cores, conductors) -> None:
    core, stimulus = cores[config], samples(COUNTS if number % 2 else HEADING, number)
    # The first sample comes when `calibrate_inertial` and program 0 have loaded their states.
    played = play(core, script_of(stimulus, start=("o 3", "u 1", "w 100")))
    check_words(core, stimulus, played)
    took = np.array(played.updated) - np.array(played.sampled)
    latency = conductors[config].latency(number)
    loading = core.image.restarts[number] if number else 0
    assert took.tolist() == [latency + loading, *[latency] * (STEPS - 1)]
    # Calibration and all else beside the filter.
    assert latency <= core.parts[number].schedule.length + 80


def test_filters_gaps_and_restarts_by_turns(cores) -> None:
    """Every kind of line, filters in any order, gaps, a stamp that wraps."""
    core, rng = cores["small"], np.random.default_rng(3)
    a, b = samples(COUNTS, steps=200), samples(HEADING, steps=200)
    mixed = rng.random(200) < 0.5
    line = np.where(mixed, a.line, b.line)
    gaps = rng.choice([97656, 97656, 97656, 2**26, 2**31 + 5], 200)
    stimulus = Samples(
        (2**32 - 500_000 + np.cumsum(gaps)) % 2**32,
        a.counts,
        line,
        np.where(mixed[:, None], a.values, b.values),
        rng.random(200) < 0.1,
        rng.integers(0, 4, 200),
    )
    stimulus.restart[0] = True
    check_words(core, stimulus, play(core, script_of(stimulus)))


def test_initial_states_on_order(cores) -> None:
    """The update after the next is as the first after power-up, bias and all."""
    core, number, at = cores["small"], FILTERS.index("complementary"), 40
    stimulus = samples(HEADING, number)
    script = script_of(stimulus)
    orders = [k for k, command in enumerate(script) if command.startswith("s ")]
    script.insert(orders[at - 1], "i")
    stimulus.restart[at] = True
    played = play(core, script)
    later = samples(HEADING, number, STEPS - at, at)
    later.line[:] = stimulus.line[at:]
    outputs = played.words(Place.OUTPUTS, 8)
    assert (outputs[at:] == run_chain(programs(core), later).outputs).all()
    assert (outputs[at:] != run_chain(programs(core), stimulus).outputs[at:]).any()


def test_the_host_writes_and_reads_meanwhile(cores) -> None:
    """A parameter counts from the next update on; the program's number cannot be written; reads
    are right at any time."""
    core, stimulus = cores["small"], samples()
    address = core.select(4).parameter_addresses["gyro_bias_z"]
    program = core.parts[4].program
    number = program.find("gyro_bias_z")
    word = int(program.format(number).quantise(0.25))
    rng = random.Random(1)
    out = ["o 3", "u 1", "f 0", "w 10"]
    for k in range(len(stimulus)):
        if k == 30:
            out += ["d 514", f"b {address} {word:x}"]
        out.append(sample_command(stimulus.stamp[k], stimulus.counts[k]))
        if k + 1 < len(stimulus) and stimulus.line[k + 1]:
            out.append("l 1 " + " ".join(f"{int(v) & 0xFFFF:x}" for v in stimulus.values[k + 1]))
        for _ in range(rng.randrange(4)):
            out += [
                f"w {rng.randrange(120)}",
                f"b {PROGRAM} {rng.randrange(8):x}",
                "d 515",
                f"b {address} {word if k >= 30 else 0:x}",
            ]
        out += [f"n {k + 1}", f"w {100 + 70}"]
    played = play(core, out)
    before = run_chain(programs(core), stimulus)
    later = system_core(FILTERS, params={"calibrate_inertial": {"gyro_bias_z": 0.25}})
    after = run_chain(programs(later), stimulus)
    records = played.words(Place.INPUTS, 10)
    assert (records[:30] == before.records[:30]).all()
    assert (records[30:] == after.records[30:]).all()
    assert (played.words(Place.OUTPUTS, 8)[:30] == before.outputs[:30]).all()
    assert len({word for address, word in played.reads if address == 515}) == 1
    assert not played.named("framing")


def test_an_update_that_is_held_stays(cores) -> None:
    core, stimulus = cores["small"], samples(steps=12)
    script = []
    for line in script_of(stimulus):
        script.append(line)
        if line == "n 3":
            script.append("t")
        if line in ("n 5", "n 9", "n 12"):
            script += ["w 100", "q"]
    played = play(core, script)
    assert [words[Place.HEADER] & 0xFFFF for words in played.taken] == [3, 3, 3]
    assert all(
        words[Place.OUTPUTS : Place.OUTPUTS + 8]
        == played.results[2][Place.OUTPUTS : Place.OUTPUTS + 8]
        for words in played.taken
    )


@pytest.mark.parametrize("seed", range(3))
def test_samples_and_lines_in_any_cycle(seed: int, cores) -> None:
    """An update has the words of one sample and of one line, whatever else comes meanwhile."""
    core, rng = cores["small"], np.random.default_rng(seed)
    script, sent, fields, stamp = ["o 3", "u 1", "f 0", "w 10"], [], {0: set(), 1: set()}, 0
    front = programs(core)[len(FILTERS) :]
    for k in range(150):
        if k % 3 == 0:  # the reader holds the words of a sample that is at work
            script.append("w 700")
            stamp += 90_000
            counts = rng.integers(-5000, 5000, 6).tolist()
        script.append(sample_command(stamp, counts))
        sent.append(counts)
        for _ in range(rng.integers(3)):
            kind, values = int(rng.integers(2)), rng.integers(0, 900, 3)
            script += [f"w {rng.integers(400)}", f"l {kind} " + " ".join(f"{v:x}" for v in values)]
            program = front[1 if kind else 2]
            words = values[:, None] << program.format(program.inputs[0]).frac
            fields[kind].add(tuple(Interpreter(program).update(words)[0][:, 0].tolist()))
        script += [f"f {rng.integers(4)}"] * (rng.random() < 0.2) + [f"w {rng.integers(500)}"]
        if k % 3 == 2:  # two at once, some of them beside the work at a line
            script += [sample_command(stamp, counts), "w 3", sample_command(stamp, counts)]
            sent += [counts, counts]
    played = play(core, [*script, "w 1000"])
    assert len(played.results) + len(played.named("sample_dropped")) == len(sent)
    assert played.named("sample_dropped") and played.named("field_dropped")
    assert not played.named("framing")
    header = {f.name: f.of(played.words(Place.HEADER, 1)[:, 0]) for f in HEADER}
    raw, records = played.words(Place.RAWS, 6), played.words(Place.INPUTS, 10)
    assert {*map(tuple, (raw >> 16).tolist())} <= {*map(tuple, sent)}
    stamps = played.words(Place.STAMP, 1)[:, 0]
    restart = np.where(header["restart"], -(2**31), 0)
    inertial = interpret(front[0], np.column_stack([raw, stamps, restart]))[0]
    columns = [front[0].output_names.index(i.name) for i in INPUTS if i.name[0] != "m"]
    assert (
        records[:, [k for k, i in enumerate(INPUTS) if i.name[0] != "m"]] == inertial[:, columns]
    ).all()
    used = 0
    for row in np.flatnonzero(header["field_used"]):
        used += tuple(records[row, 4:7].tolist()) in fields[int(header["field_counts"][row])]
    assert used == np.count_nonzero(header["field_used"]) > 20
    for number in range(len(FILTERS)):
        rows = header["filter"] == number
        outputs, saturated, _, _ = interpret(programs(core)[number], records[rows])
        assert (played.words(Place.OUTPUTS, 8)[rows] == outputs).all()
        assert (header["saturated"][rows] == saturated).all()


def test_nothing_runs_while_run_is_low(cores) -> None:
    sample = sample_command(5, (1, 2, 3, 4, 5, 6))
    played = play(
        cores["small"],
        ["o 3", "u 1", sample, "n 1", "u 0", sample, "w 2000", "u 1"]
        + [sample, "n 2", sample, "n 3", "w 100"],
    )
    restart = next(f for f in HEADER if f.name == "restart")
    assert restart.of(played.words(Place.HEADER, 1)[:, 0]).tolist() == [1, 1, 0]
    assert not played.named("sample_dropped")


def test_input_registers_are_taken_as_a_set() -> None:
    """A record has words of one set, wherever the host is with the next one."""
    core, rng = odd_board().core, random.Random(6)
    script, sets = ["u 1", "f 0", "w 10"], [(0, 0)]
    for k in range(120):
        sets.append((2 * k + 2, 2 * k + 3))
        script += [f"w {rng.randrange(200)}", f"e 0 {2 * k + 2:x}", f"w {rng.randrange(200)}"]
        script += [f"e 1 {2 * k + 3:x}", "k"]
        if k % 2:
            script += [f"w {rng.randrange(150)}", sample_command(1000 * k, (0,) * 6)]
    played = play(core, [*script, "w 1000"])
    program = core.parts[0].program
    names = [program.values[n].name for n in program.inputs]
    records = played.words(Place.INPUTS, len(names))
    pairs = [(r[names.index("target")], r[names.index("offset")]) for r in records.tolist()]
    assert len(pairs) > 40 and len({*pairs}) > 20 and {*pairs} <= {*sets}
    new = [pair != before for before, pair in zip([(0, 0), *pairs], pairs, strict=False)]
    assert (records[:, names.index("set_new")] != 0).tolist() == new
