"""Levels: one update at a time and all at once, resets, and how they agree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State, with_params
from boresight.model.estimators import ESTIMATORS, estimator
from boresight.sim.levels.floating import CompiledFloat, NumpyFloat
from boresight.sim.levels.integer import Emitted, Interpreted, words_of
from boresight.sim.levels.level import run_of_words
from boresight.sim.levels.registry import LEVELS, make_level
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record

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
    level = make_level(name, Leaky(), params={"rate": 0.25})
    found = level.run(RECORDS)
    assert list(found.outputs) == ["y", "sum"]
    assert np.abs(found.outputs["y"] - Y).max() < 2e-8
    assert np.abs(found.outputs["sum"] - SUM).max() < 2e-8
    assert level.name == name
    assert (found.words is None) == (found.saturated is None) == (name in ("numpy", "float"))
    level.close()


@pytest.mark.parametrize("name", QUICK)
def test_steps_are_a_run_and_reset_starts_anew(name: str) -> None:
    level = make_level(name, Leaky(), params={"rate": 0.25})
    whole = level.run(RECORDS).outputs
    gone_on = level.run(RECORDS).outputs  # goes on where the last one stopped
    assert gone_on["y"][0] == pytest.approx(0.75 * Y[-1] + 0.25, abs=2e-8)
    level.reset()
    steps = [level.step(record) for record in RECORDS]
    assert all(isinstance(value, float) for step in steps for value in step.values())
    for output, values in whole.items():
        assert [step[output] for step in steps] == values.tolist()
    assert level.step(RECORDS[0]) == {o: v[0] for o, v in gone_on.items()}
    level.reset()
    halves = [level.run(RECORDS[:3]), level.run(RECORDS[3:])]
    for output, values in whole.items():
        assert np.concatenate([h.outputs[output] for h in halves]).tolist() == values.tolist()
    level.close()


def test_two_of_a_kind_share_nothing() -> None:
    for name in QUICK:
        one, other = (make_level(name, Leaky()) for _ in range(2))
        one.run(RECORDS)
        assert other.step(RECORDS[0])["y"] == 1.0


def test_a_run_of_a_log() -> None:
    """`Emitted` equals `Interpreted`, whole and step by step; words, values and saturation."""
    records = feed(estimator("mekf"), read_record(bundled("ximu_walk")).head(200)).inputs
    program = estimator("mekf").compile()
    slow, quick = Interpreted(program).run(records), Emitted(program).run(records)
    assert slow.words is not None and slow.saturated is not None
    assert np.array_equal(slow.words, quick.words)
    assert np.array_equal(slow.saturated, quick.saturated)
    for name, value in zip(program.output_names, program.outputs, strict=True):
        assert np.array_equal(slow.outputs[name], quick.outputs[name])
        k = program.output_names.index(name)
        assert np.array_equal(quick.outputs[name], program.format(value).real(slow.words[:, k]))
    level = Emitted(program)
    for k, record in enumerate(records[:40]):
        assert level.step(record) == {n: v[k] for n, v in quick.outputs.items()}


class Narrow(Leaky):
    """Its state cannot hold what it computes."""

    states = (State("y", -0.5, 0.5, "m"),)


@pytest.mark.parametrize("kind", [Interpreted, Emitted])
def test_saturation_is_told(kind: Any) -> None:
    found = kind(Narrow().compile()).run(np.array([[0.5, 0.0], [2.0, 0.0], [0.0, 0.0]]))
    assert found.saturated.tolist() == [False, True, False]
    assert found.saturated.dtype == np.bool_


def test_words_clamp() -> None:
    program = Leaky().compile(word=18)
    assert words_of(program, np.array([[9.0, -9.0], [0.5, 0.25]])).tolist() == [
        [131071, -131072],
        [1 << 14, 1 << 14],
    ]


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


@pytest.mark.parametrize("log", ["ximu_walk", "synthetic_60s"])
@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_compiled_float64_is_the_reference_within_rounding(name: str, log: str) -> None:
    records = feed(estimator(name), read_record(bundled(log)).head(300)).inputs
    reference = estimator(name).run_float(records[:, :, None]).outputs
    found = CompiledFloat(estimator(name)).run(records).outputs
    assert list(found) == [o.name for o in estimator(name).outputs]
    for o in estimator(name).outputs:
        assert found[o.name].dtype == np.float64
        apart = np.abs(found[o.name] - reference[o.name][:, 0])
        if o.unit == "ht":
            apart = np.abs((apart + 1.0) % 2.0 - 1.0)
        assert apart.max() <= 1e-12, o.name


def test_numpy_is_the_reference() -> None:
    records = feed(estimator("complementary"), read_record(bundled("ximu_walk")).head(40)).inputs
    found = NumpyFloat(estimator("complementary"))
    reference = estimator("complementary").run_float(records[:, :, None]).outputs
    for name, values in found.run(records).outputs.items():
        assert np.array_equal(values, reference[name][:, 0])


class Third(Estimator):
    """What single precision does not hold."""

    inputs = (Input("z", 0.0, 4.0, ""),)
    params = (Param("k", 1.0 / 3.0, 0.0, 1.0),)
    states = (State("x", -9.0, 9.0, "", 0.1),)
    outputs = (Output("y"), Output("sum"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        total = x.x + p.k * u.z
        return {"x": total}, {"y": 0.7 * u.z, "sum": total}


def test_double_precision_throughout() -> None:
    z, k = 1.1, 0.3
    level = CompiledFloat(Third(), {"k": k})
    assert level.step(np.array([z])) == {"y": 0.7 * z, "sum": 0.1 + k * z}
    level.reset()  # keeps the parameters
    assert level.step(np.array([z]))["sum"] == 0.1 + k * z
    assert CompiledFloat(Third()).step(np.array([z]))["sum"] == 0.1 + z * (1.0 / 3.0)
    with pytest.raises(ValueError, match=r"^inputs must have shape \(n, 1\), not \(3, 2\)$"):
        FloatCModel(Third(), precision=DOUBLE).update(np.zeros((3, 2)))


def test_parameters_reach_every_level() -> None:
    for name in QUICK:
        assert make_level(name, Leaky(), params={"rate": 0.0}).step(RECORDS[1])["y"] == 1.0
        with pytest.raises(InputError, match="^parameter rate: wanted 0 to 1"):
            make_level(name, Leaky(), params={"rate": 2.0})


def test_word_width_reaches_the_integers() -> None:
    for name in ("fixed", "c"):
        found = make_level(name, Leaky(), word=18, params={"rate": 0.25}).run(RECORDS)
        assert found.words is not None and np.abs(found.words).max() < 1 << 17
        assert 1e-7 < np.abs(found.outputs["sum"] - SUM).max() + 1e-6 < 1e-3
    program = with_params(Leaky().compile(word=18), Leaky(), {"rate": 0.25})
    assert np.array_equal(Interpreted(program).run(RECORDS).words, found.words)


def test_no_such_level() -> None:
    with pytest.raises(
        InputError,
        match=r"^level: wanted one of numpy, float, fixed, c, rtl, found 'vhdl'; choose of these$",
    ):
        make_level("vhdl", Leaky())
