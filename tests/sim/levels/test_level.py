"""Levels: builds, registry, one update and many."""

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import LEVELS, make_level
from tests.support.estimators import Leaky

# -- levels: one update at a time and all at once, resets, and how they agree ---------------------

#: Levels that need no simulator: tests/sim/levels/test_rtl.py and tests/sim/rtl have the others.
QUICK = tuple(name for name in LEVELS if name not in ("rtl", "netlist"))


RECORDS = np.array([[1.0, 0.0], [0.0, 0.25], [-2.0, -1.0], [0.5, 0.5]])
#: By hand, with rate 0.25.
Y = [1.0, 0.75, 0.0625, 0.171875]
SUM = [1.0, 0.0, 3.0625, -1.328125]


@pytest.mark.parametrize("name", QUICK)
def test_by_hand(name: str) -> None:
    level = make_level(name, Build(Leaky(), params=[{"rate": 0.25}]))
    outcome = level.run(RECORDS)
    assert list(outcome.outputs) == ["y", "sum"]
    assert np.abs(outcome.outputs["y"] - Y).max() < 2e-8
    assert np.abs(outcome.outputs["sum"] - SUM).max() < 2e-8
    assert level.name == name
    assert (outcome.words is None) == (outcome.saturated is None) == (name in ("numpy", "float"))
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


def test_parameters_reach_every_level() -> None:
    for name in QUICK:
        level = make_level(name, Build(Leaky(), params=[{"rate": 0.0}]))
        assert level.step(RECORDS[1]).outputs["y"] == 1.0
        with pytest.raises(InputError, match="^parameter rate: wanted 0 to 1"):
            make_level(name, Build(Leaky(), params=[{"rate": 2.0}]))


class Turning(Estimator):
    """A phase, told as unsigned turns; the same as half turns."""

    inputs = (Input("a", -4.0, 4.0),)
    outputs = (Output("phase", "turn"), Output("half", "ht"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"phase": ops.wrap_turns(u.a), "half": ops.wrap_ht(2.0 * u.a)}


@pytest.mark.parametrize("name", QUICK)
def test_turns_are_told_from_zero_to_one(name: str) -> None:
    level = make_level(name, Build(Turning()))
    outcome = level.run(np.array([[-0.25], [0.5], [3.75], [-4.0]])).outputs
    assert outcome["phase"].tolist() == [0.75, 0.5, 0.75, 0.0]
    assert outcome["half"].tolist() == [-0.5, -1.0, -0.5, 0.0]
    level.reset()
    assert level.step(np.array([-0.125])).outputs["phase"] == 0.875


class Line(Estimator):
    """A delay line, and two states that change places."""

    inputs = (Input("a", -1.0, 1.0),)
    states = tuple(
        State(name, -1.0, 1.0, initial=first)
        for name, first in {"p": 0.5, "q": -0.5, "r": 0.25, "s": 0.5, "t": 0.75}.items()
    )
    outputs = (Output("last"), Output("p"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Every next state is what another one was before."""
        states = {"p": x.q, "q": x.p, "r": u.a, "s": 0.5 * x.r, "t": x.s}
        return states, {"last": x.t, "p": states["p"]}


@pytest.mark.parametrize("name", QUICK)
def test_states_change_all_at_once(name: str) -> None:
    outcome = make_level(name, Build(Line())).run(np.array([[0.25], [0.5], [0.75], [1.0]])).outputs
    assert outcome["last"].tolist() == [0.75, 0.5, 0.125, 0.125]
    assert outcome["p"].tolist() == [-0.5, 0.5, -0.5, 0.5]


def test_runs_side_by_side() -> None:
    """Each is a run of its own; one update of all of them is a step."""
    build = Build(Leaky(), params=[{"rate": 0.25}])
    level, alone = make_level("c", build, runs=3), make_level("c", build)
    records = np.stack([RECORDS, -RECORDS, 4.0 * RECORDS.clip(-0.5, 0.5)], axis=1)
    whole = level.run_anew(records)
    level.reset()
    steps = [level.step(row) for row in records]
    assert (level.name, level.runs) == ("c", 3)
    for k in range(3):
        wanted = alone.run_anew(records[:, k])
        for output, values in wanted.outputs.items():
            assert whole.outputs[output][:, k].tolist() == values.tolist()
            assert [s.outputs[output][0, k] for s in steps] == values.tolist()
        for part in ("words", "saturated"):
            assert (getattr(whole, part)[:, k] == getattr(wanted, part)).all()
    with pytest.raises(InputError, match="^level: wanted c, which has runs side by side, found"):
        make_level("fixed", build, runs=3)


# -- A build: programs with parameters, their nodes, and one core ---------------------------------


def test_parameters_are_of_their_estimator() -> None:
    two = (estimator("complementary"), estimator("ma2014_cf"))
    plain, moved = Build(*two), Build(*two, params=[None, {"kp_roll": 0.25}])
    assert plain.params == (None, None)
    assert moved.programs[0] == plain.programs[0] and moved.programs[1] != plain.programs[1]
    n = moved.programs[1].find("kp_roll")
    assert moved.programs[1].format(n).real(moved.programs[1].values[n].initial) == 0.25
    with pytest.raises(ValueError, match="shorter"):
        Build(*two, params=[None])
