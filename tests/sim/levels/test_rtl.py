"""The core's Verilog as a level; records for the plain bench."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.model.attitude import estimator
from boresight.model.estimator import State
from boresight.model.resolve import estimator_of
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind
from boresight.sim.levels import rtl as module
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import Interpreted, words_of
from boresight.sim.levels.registry import level_of, make_level
from boresight.sim.levels.rtl import Simulated
from boresight.sim.levels.vectors import recorded
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.estimators import Leaky
from tests.support.track import Track

# -- the core's Verilog as a level: records, closed loops, and every word of an update ------------


class Narrow(Leaky):
    """Its state saturates."""

    states = (State("y", -0.5, 0.5, "m", 0.25),)


RECORDS = np.random.default_rng(3).uniform(-1, 1, (60, 2)) * [2.0, 1.0]


def test_steps_and_records() -> None:
    """One build: words, cycles, resets."""
    build = Build(Narrow(), word=18)
    wanted = Interpreted(build).run(RECORDS)
    assert wanted.saturated is not None and wanted.words is not None
    assert (wanted.words < 0).any() and wanted.saturated.any() and not wanted.saturated.all()
    with Simulated(build) as level:
        level.close()  # nothing to close yet
        for _ in range(2):  # the second time after a reset in the middle
            for k in range(20):
                assert level.step(RECORDS[k]).outputs == {
                    n: v[k] for n, v in wanted.outputs.items()
                }
            level.reset()
        entries = [level.step(record) for record in RECORDS]
        for name, values in wanted.outputs.items():
            assert [step.outputs[name][0] for step in entries] == values.tolist()
        assert [bool(step.saturated[0]) for step in entries] == wanted.saturated.tolist()
        assert level._process is not None
        process = level._process.process
    assert process.poll() is not None and level._process is None
    run = level.run(RECORDS)  # from the reset on
    assert run.words is not None and np.array_equal(run.words, wanted.words)
    assert run.saturated is not None and np.array_equal(run.saturated, wanted.saturated)
    assert run.fault == "" and run.states is None
    assert run.latency_cycles is not None and run.interval_cycles is not None
    assert (run.latency_cycles == level.schedule.latencies).all()
    assert (run.interval_cycles == level.schedule.interval).all()
    together = Simulated.run_together([level], [RECORDS])[0].words
    assert together is not None and np.array_equal(together, wanted.words)


@pytest.mark.parametrize(
    ("interval", "latency", "message"),
    [
        (1, 0, r"the update took (\d+) cycles, the schedule says (?!\1$)\d+"),
        (0, 1, "output cycles differ from the schedule"),
    ],
)
def test_a_step_takes_the_cycles_of_the_schedule(
    interval: int, latency: int, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    level = Simulated(Build(Narrow(), word=18))
    plan = level.schedule
    changed = SimpleNamespace(
        interval=plan.interval + interval, latencies=[n + latency for n in plan.latencies]
    )
    monkeypatch.setattr(Simulated, "schedule", changed)
    with level, pytest.raises(SimulationFailed, match=f"^rtl: {message}$"):
        level.step(RECORDS[0])


def test_every_word_of_an_update() -> None:
    """Named by where and when the lanes write."""
    level = Simulated(Build(Narrow(), word=18))
    program = level.schedule.program
    machine = Interpreter(program)
    for row in words_of(level.program, RECORDS[:7]):
        machine.update(row[:, None])
    wanted = machine.values_before_commit()
    seen = level.words_of_update(RECORDS[:7])
    assert {s.value for s in seen} == {op.dest for op in program.ops}
    assert all(s.word == wanted[s.value][0] for s in seen)
    cycles = [s.cycle for s in seen]
    assert None not in cycles and cycles == sorted(cycles, key=lambda c: c or 0)
    # What does not come where the schedule says is told last, in the order in which it should.
    whole = level._replayed

    def without_the_first(*args: Any, **options: Any) -> Any:
        run = whole(*args, **options)
        return dataclasses.replace(run, writes=run.writes[2:])

    level._replayed = without_the_first  # type: ignore[method-assign]
    less = level.words_of_update(RECORDS[:7])
    assert sorted(s.value for s in less) == sorted(s.value for s in seen)
    lost = [s for s in less if s.word is None]
    assert less[len(less) - len(lost) :] == lost and 1 <= len(lost) <= 2
    assert [s.cycle for s in lost] == cycles[: len(lost)]


@pytest.mark.parametrize(("tool", "pieces"), [("verilator", [3, 2, 2]), ("icarus", [7])])
def test_pieces_before_an_update(tool: str, pieces: list[int]) -> None:
    """One after the other in a simulation that goes on; at once in one that does not."""
    level = Simulated(Build(Narrow(), word=18), tool=tool)
    rows = []

    def replayed(words: Any, **options: Any) -> Any:
        rows.append(words)
        return SimpleNamespace(writes=())

    level._replayed = replayed  # type: ignore[method-assign]
    level.words_of_update(RECORDS[5:7], [RECORDS[:3], RECORDS[3:5]])
    assert [len(words) for words in rows] == pieces
    assert np.array_equal(np.concatenate(rows), words_of(level.program, RECORDS[:7]))


class Other(Leaky):
    """Beside the first one in a core."""


def test_every_word_of_the_first_update_of_a_shared_core() -> None:
    """What the core does until the program is selected does not count."""
    build = Build(Narrow(), Other(), word=18)
    for number in (0, 1):
        level = Simulated(build, number)
        machine = Interpreter(level.schedule.program)
        machine.update(words_of(level.program, RECORDS[:1]).T)
        wanted = machine.values_before_commit()
        seen = level.words_of_update(RECORDS[:1])
        assert seen and all(s.word == wanted[s.value][0] for s in seen)


def test_which_simulators_a_check_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Simulated.tools_of_check("icarus") == ("icarus",)
    for there, wanted in (
        ("verilator icarus", "verilator"),
        ("icarus", "icarus"),
        ("", "verilator"),
    ):
        monkeypatch.setattr(module, "available", lambda name, there=there: name in there)
        assert Simulated.tools_of_check(None) == (wanted,)


def test_icarus_is_not_waited_for() -> None:
    build = Build(Narrow(), word=18)
    cycles = build.core.schedule.interval
    assert Simulated(build).record_limit is None
    assert Simulated(build, tool="icarus").record_limit == module.ICARUS_CYCLES // cycles > 1


# -- records for the plain bench: from the log where it fits, within the ranges where not ---------


def test_wandering() -> None:
    build = Build(Track())
    (run,) = recorded(build)
    program = build.programs[0]
    assert run.inputs.shape == (60, 4) and run.outputs.shape == (60, 3)
    for words, number in zip(run.inputs.T, program.inputs, strict=True):
        low, high = (program.format(number).quantise(x) for x in (
            program.values[number].low, program.values[number].high))  # fmt: skip
        assert ((low <= words) & (words <= high)).all() and len(set(words)) > 1
        step = (high - low) // 8
        kind = program.values[number].name
        if kind in ("dt", "w"):
            assert (np.abs(np.diff(words)) <= step).all() and np.ptp(words) > 2 * step
        elif kind == "seen":
            assert set(words) == {low, high}
        else:
            assert 2 <= np.count_nonzero(words == low) <= 20  # what says "no sample"
    (again,) = recorded(Build(Track()))
    assert (again.inputs == run.inputs).all() and (again.outputs == run.outputs).all()
    assert run.saturated.any() and not run.saturated.all()


def test_from_the_log() -> None:
    build = Build(estimator("complementary"))
    (run,) = recorded(build)
    columns = feed(build.estimators[0], read_record(bundled("synthetic_60s")))
    count = len(run.inputs)
    assert run.source == f"synthetic_60s, samples 4000 to {3999 + count}"
    assert (run.inputs == columns.words(build.programs[0])[4000 : 4000 + count]).all()
    assert count == 10_000 // build.core.schedule.interval
    assert np.ptp(run.inputs[:, 1]) > 0 and (run.inputs[:, 4] != 0).any()


# --------------------------------------------------------------------------------------------------
# the programs of three systems in one core, in turns: RTL, C and interpreter give the same words
# In 512 registers of one lane they fit because results live in the registers of next states; with
# two lanes only 1,024 hold them.

NAMES = ("satcom", "satcom_pointing", "mls_attitude", "array_phases", "registration")
SOAK = pytest.mark.soak


def records(build: Build, number: int, steps: int, rng: np.random.Generator) -> np.ndarray:
    """Inputs all over their ranges, in runs where they hardly change, and at their ends."""
    low, high = np.array([(i.low, i.high) for i in build.estimators[number].inputs]).T
    u = rng.uniform(low, high, (steps, len(low)))
    u[steps // 3 : 2 * steps // 3] = u[steps // 3] * rng.uniform(0.99, 1.0, (1, len(low)))
    u[2 * steps // 3 :] = np.where(rng.random((-(-steps // 3), len(low))) < 0.5, low, high)
    u = u.clip(low, high)
    if NAMES[number] == "satcom":
        return np.concatenate([u, drive(steps, rng)])
    if NAMES[number] == "satcom_pointing":  # level, below the satellite
        u[::17] = [1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3, 0.0, 110.5 / 180.0, 0.0]
    return u


def drive(steps: int, rng: np.random.Generator) -> np.ndarray:
    """Inputs of `satcom`: a drive, tumbling, restarts, and a long time without tracking."""
    part = 4 * np.arange(steps)[:, None] // steps
    blind = part == 3
    u = np.zeros((steps, 10))
    u[:, :1] = np.where(blind, 0.2, 0.02)
    u[:, 1:4] = np.where(
        blind,
        rng.normal(0.0, 1e-3, (steps, 3)),
        np.cumsum(rng.normal(0.0, 0.02, (steps, 3)), axis=0).clip(-8.0, 8.0),
    )
    u[:, 4:7] = [0.0, 0.0, -9.80665] + rng.normal(size=(steps, 3)) * np.where(part == 1, 20.0, 0.05)
    u[:, 7] = rng.normal(0.0, 0.06, steps).clip(-0.5, 0.5)
    u[:, 8] = rng.uniform(-1.0, 1.0, steps)
    u[:, 9] = (rng.random(steps) < 0.2) & ~blind[:, 0]
    restarts = (part[:, 0] == 2) & (rng.random(steps) < 0.02)
    u[(np.arange(steps) == 0) | restarts, 0] = -0.02
    return u


@pytest.mark.parametrize(
    ("config", "steps"),
    [
        ("small", 12),
        *(pytest.param(c, 5000, marks=SOAK) for c in ("small", "small-1024", "fast-1024")),
    ],
)
def test_in_turns(config: str, steps: int) -> None:
    rng = np.random.default_rng(4)
    params = [{"gyro_sd": 0.05, "bias_density": 1e-3}, *[None] * (len(NAMES) - 1)]
    build = Build(*map(estimator_of, NAMES), config=config, params=params)
    numbers = range(len(NAMES))
    inputs = [records(build, k, steps + k, rng) for k in numbers]
    runs = {
        name: level_of(name).run_together([make_level(name, build, k) for k in numbers], inputs)
        for name in ("fixed", "c", "rtl")
    }
    for k, wanted in enumerate(runs["fixed"]):
        for name in ("c", "rtl"):
            assert not runs[name][k].fault
            assert (runs[name][k].words == wanted.words).all(), (name, NAMES[k])
            assert (runs[name][k].saturated == wanted.saturated).all(), (name, NAMES[k])
        assert (runs["rtl"][k].interval_cycles == build.core.parts[k].schedule.interval).all()
    status, pointing = (np.rint(run.outputs["status"]).astype(int) for run in runs["c"][:2])
    assert np.bitwise_or.reduce(pointing) == 3
    # A variance comes to its limit after some hundred records.
    assert np.bitwise_or.reduce(status) == (15 if steps > 12 else 7)
    _rooms(build, crowded=config == "small")


def _rooms(build: Build, *, crowded: bool) -> None:
    """Whether results have gone to the registers of next states."""
    for part in build.core.parts:
        where = part.allocation.addresses()
        nexts = {where[after] for _, after in part.schedule.program.states}
        results = [n for n in where if part.schedule.program.values[n].kind is Kind.OP]
        guests = sum(where[n] in nexts for n in results) - len(nexts)
        assert (guests > 0) == (crowded and bool(nexts)), part.program.name
