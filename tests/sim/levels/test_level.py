"""Levels: one update at a time and all at once, resets, and how they agree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import Interpreted
from boresight.sim.levels.level import run_of_words
from boresight.sim.levels.registry import LEVELS, make_level

#: Levels that need no simulator: tests/sim/levels/test_rtl.py has the other.
QUICK = tuple(name for name in LEVELS if name != "rtl")


class Leaky(Estimator):
    """A low pass whose state starts at 1; ``sum`` saturates beyond 4."""

    inputs = (Input("u", -2.0, 2.0, "m"), Input("v", -1.0, 1.0, "m"))
    params = (Param("rate", 0.5, 0.0, 1.0),)
    states = (State("y", -2.0, 2.0, "m", 1.0),)
    outputs = (Output("y", "m"), Output("sum", "m"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + p.rate * (u.u - x.y)
        return {"y": y}, {"y": y, "sum": y - 3.0 * u.v}


RECORDS = np.array([[1.0, 0.0], [0.0, 0.25], [-2.0, -1.0], [0.5, 0.5]])
#: By hand, with rate 0.25.
Y = [1.0, 0.75, 0.0625, 0.171875]
SUM = [1.0, 0.0, 3.0625, -1.328125]


@pytest.mark.parametrize("name", QUICK)
def test_by_hand(name: str) -> None:
    level = make_level(name, Build(Leaky(), params=[{"rate": 0.25}]))
    found = level.run(RECORDS)
    assert list(found.outputs) == ["y", "sum"]
    assert np.abs(found.outputs["y"] - Y).max() < 2e-8
    assert np.abs(found.outputs["sum"] - SUM).max() < 2e-8
    assert level.name == name
    assert (found.words is None) == (found.saturated is None) == (name in ("numpy", "float"))
    level.close()


@pytest.mark.parametrize("name", QUICK)
def test_steps_are_a_run_and_reset_starts_anew(name: str) -> None:
    level = make_level(name, Build(Leaky(), params=[{"rate": 0.25}]))
    whole = level.run(RECORDS).outputs
    gone_on = level.run(RECORDS).outputs  # goes on where the last one stopped
    assert gone_on["y"][0] == pytest.approx(0.75 * Y[-1] + 0.25, abs=2e-8)
    assert (level.run_anew(RECORDS).outputs["y"] == whole["y"]).all()
    level.reset()
    steps = [level.step(record) for record in RECORDS]
    for output, values in whole.items():
        assert [step.outputs[output].tolist() for step in steps] == [[v] for v in values]
    assert level.step(RECORDS[0]).outputs == {o: v[:1] for o, v in gone_on.items()}
    level.reset()
    halves = [level.run(RECORDS[:3]), level.run(RECORDS[3:])]
    for output, values in whole.items():
        assert np.concatenate([h.outputs[output] for h in halves]).tolist() == values.tolist()
    level.close()


def test_two_of_a_kind_share_nothing() -> None:
    for name in QUICK:
        one, other = (make_level(name, Build(Leaky())) for _ in range(2))
        one.run(RECORDS)
        assert other.step(RECORDS[0]).outputs["y"] == 1.0


def test_words_with_their_cycles() -> None:
    program = Leaky().compile(word=18)
    words = np.array([[1 << 16, 1 << 15], [0, -1]])
    cycles = {
        "states": np.array([[1], [2]]),
        "latency_cycles": np.array([[3, 4], [3, 4]]),
        "interval_cycles": np.array([5, 6]),
    }
    found = run_of_words(program, words, np.array([False, True]), **cycles)
    lsb = [program.format(value).lsb for value in program.outputs]
    assert found.outputs["y"].tolist() == [lsb[0] * (1 << 16), 0.0]
    assert found.outputs["sum"].tolist() == [lsb[1] * (1 << 15), -lsb[1]]
    assert found.words is words and found.saturated is not None
    assert all(getattr(found, name) is value for name, value in cycles.items())


def test_parameters_reach_every_level() -> None:
    for name in QUICK:
        level = make_level(name, Build(Leaky(), params=[{"rate": 0.0}]))
        assert level.step(RECORDS[1]).outputs["y"] == 1.0
        with pytest.raises(InputError, match="^parameter rate: wanted 0 to 1"):
            make_level(name, Build(Leaky(), params=[{"rate": 2.0}]))


def test_word_width_reaches_the_integers() -> None:
    for name in ("fixed", "c"):
        found = make_level(name, Build(Leaky(), word=18, params=[{"rate": 0.25}])).run(RECORDS)
        assert found.words is not None and np.abs(found.words).max() < 1 << 17
        assert 1e-7 < np.abs(found.outputs["sum"] - SUM).max() + 1e-6 < 1e-3
    with_rate = Build(Leaky(), word=18, params=[{"rate": 0.25}])
    assert np.array_equal(Interpreted(with_rate).run(RECORDS).words, found.words)


class Turning(Estimator):
    """A phase, told as unsigned turns; the same as half turns."""

    inputs = (Input("a", -4.0, 4.0),)
    outputs = (Output("phase", "turn"), Output("half", "ht"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"phase": ops.wrap_turns(u.a), "half": ops.wrap_ht(2.0 * u.a)}


@pytest.mark.parametrize("name", [n for n in LEVELS if n != "rtl"])
def test_turns_are_told_from_zero_to_one(name: str) -> None:
    level = make_level(name, Build(Turning()))
    found = level.run(np.array([[-0.25], [0.5], [3.75], [-4.0]])).outputs
    assert found["phase"].tolist() == [0.75, 0.5, 0.75, 0.0]
    assert found["half"].tolist() == [-0.5, -1.0, -0.5, 0.0]
    level.reset()
    assert level.step(np.array([-0.125])).outputs["phase"] == 0.875


@pytest.mark.parametrize("name", QUICK)
def test_runs_side_by_side(name: str) -> None:
    """Each is a run of its own; one update of all of them is a step."""
    build = Build(Leaky(), params=[{"rate": 0.25}])
    level, alone = make_level(name, build, runs=3), make_level(name, build)
    records = np.stack([RECORDS, -RECORDS, 4.0 * RECORDS.clip(-0.5, 0.5)], axis=1)
    whole = level.run_anew(records)
    level.reset()
    steps = [level.step(row) for row in records]
    assert (level.name, level.runs) == (name, 3)
    for k in range(3):
        wanted = alone.run_anew(records[:, k])
        for output, values in wanted.outputs.items():
            assert whole.outputs[output][:, k].tolist() == values.tolist()
            assert [s.outputs[output][0, k] for s in steps] == values.tolist()
        for part in ("words", "saturated"):
            array = getattr(wanted, part)
            assert array is None or (getattr(whole, part)[:, k] == array).all()
    level.close()
