"""The integer interpreter and the emitted C: the same words."""

from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.attitude import estimator
from boresight.model.estimator import State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted, Interpreted
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record
from tests.support.estimators import Leaky

RECORDS = np.random.default_rng(4).uniform(-1.0, 1.0, (50, 2))


def test_a_long_run_is_one_update_after_the_other() -> None:
    """In segments, and going on from there, whatever came before."""
    build, slow = Build(Leaky()), Interpreted(Build(Leaky()))
    rows = [slow.run(record[None, :]) for record in RECORDS]
    level = Interpreted(build)
    for cut in (20, 1, 40):
        long, rest = level.run(RECORDS[:cut]), level.run(RECORDS[cut:])
        for name in ("words", "saturated", "states"):
            wanted = np.concatenate([getattr(r, name) for r in rows])
            assert np.array_equal(np.concatenate([getattr(r, name) for r in (long, rest)]), wanted)
        assert long.fault == rest.fault == ""
        level.reset()


def test_states_that_differ_from_c_are_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    level, right = Interpreted(Build(Leaky())), CModel.trajectory

    def wrong(model: CModel, inputs: Any) -> Any:
        outputs, saturated, states = right(model, inputs)
        states[7, 0] ^= 1  # the last step of the first of six segments
        return outputs, saturated, states

    level.run(RECORDS)
    monkeypatch.setattr(CModel, "trajectory", wrong)
    assert level.run(RECORDS).fault == "states differ from C after step 57"


def test_a_run_of_a_log() -> None:
    """`Emitted` equals `Interpreted`, whole and step by step; words, values and saturation."""
    records = feed(estimator("mekf"), read_record(bundled("ximu_walk")).head(200)).inputs
    build = Build(estimator("mekf"))
    (program,) = build.programs
    slow, quick = Interpreted(build).run(records), Emitted(build).run(records)
    assert slow.words is not None and slow.saturated is not None
    assert np.array_equal(slow.words, quick.words)
    assert np.array_equal(slow.saturated, quick.saturated)
    for name, value in zip(program.output_names, program.outputs, strict=True):
        assert np.array_equal(slow.outputs[name], quick.outputs[name])
        k = program.output_names.index(name)
        assert np.array_equal(quick.outputs[name], program.format(value).real(slow.words[:, k]))
    level = Emitted(build)
    for k, record in enumerate(records[:40]):
        assert level.step(record).outputs == {n: v[k] for n, v in quick.outputs.items()}


@pytest.mark.parametrize("kind", [Emitted, CompiledFloat])
def test_parameters_are_set_for_good(kind: Any) -> None:
    """As if they had been built in, also after a reset; what is not named has its default again."""
    records = feed(estimator("complementary"), read_record(bundled("ximu_walk")).head(30)).inputs
    level = kind(Build(estimator("complementary")))
    for params in ({"kp_roll_per_s": 4.0}, {"declination_ht": 0.1}, None):
        level.set_params(params)
        level.reset()
        wanted = kind(Build(estimator("complementary"), params=[params])).run(records).outputs
        made = level.run(records).outputs
        assert all(np.array_equal(made[name], values) for name, values in wanted.items())


class Narrow(Leaky):
    """Its state cannot hold what it computes."""

    states = (State("y", -0.5, 0.5, "m"),)


@pytest.mark.parametrize("kind", [Interpreted, Emitted])
def test_saturation_is_told(kind: Any) -> None:
    result = kind(Build(Narrow())).run(np.array([[0.5, 0.0], [2.0, 0.0], [0.0, 0.0]]))
    assert result.saturated.tolist() == [False, True, False]
    assert result.saturated.dtype == np.bool_
