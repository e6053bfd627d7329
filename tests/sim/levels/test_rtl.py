"""The core's Verilog as a level; records for the plain bench."""

from types import SimpleNamespace

import numpy as np
import pytest

from boresight.model.estimator import State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import Interpreted
from boresight.sim.levels.rtl import Simulated, recorded
from boresight.sim.rtl import simulators
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


def test_which_simulator_a_check_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    for there, wanted in (
        ("verilator icarus", "verilator"),
        ("icarus", "icarus"),
        ("", "verilator"),
    ):
        monkeypatch.setattr(simulators, "available", lambda name, there=there: name in there)
        assert simulators.default_simulator() == wanted


# -- records for the plain bench: from the log where it fits, within the ranges where not ---------


def test_wandering() -> None:
    build = Build(Track())
    (run,) = recorded(build)
    program = build.programs[0]
    assert run.inputs.shape == (60, 4) and run.outputs.shape == (60, 3)
    assert np.flatnonzero(run.beyond).tolist() == [58]
    for words, number in zip(np.delete(run.inputs, 58, 0).T, program.inputs, strict=True):
        low, high = (program.format(number).quantise(x) for x in (
            program.values[number].low, program.values[number].high))  # fmt: skip
        assert ((low <= words) & (words <= high)).all() and len(set(words)) > 1
        step = (high - low) // 8
        kind = program.values[number].name
        if kind in ("dt", "w"):
            assert (np.abs(np.diff(words[:58])) <= step).all() and np.ptp(words) > 2 * step
            assert abs(words[58] - words[57]) <= 2 * step  # one record is left out between them
        elif kind == "seen":
            assert set(words) == {low, high}
        else:
            assert 2 <= np.count_nonzero(words == low) <= 20  # what says "no sample"
    (again,) = recorded(Build(Track()))
    assert (again.inputs == run.inputs).all() and (again.outputs == run.outputs).all()
    assert run.saturated.any() and not run.saturated.all()
