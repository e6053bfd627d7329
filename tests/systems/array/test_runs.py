"""Runs: figures of known errors, and one short run of the real thing."""

import dataclasses

import numpy as np
import pytest

from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.array import world as world_of_arrays
from boresight.systems.array.cases import CASES
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.runs import EVERY, errors_of, figures_of, run_array, turned
from boresight.systems.array.world import ANGLES, ERECTED, TurningArray


def test_figures(told) -> None:
    runs = figures_of([told(1.0), told(2.0, least_eigenvalue=300.0, saturated=7)])
    f = runs.figures
    assert f["roll_rms"] == pytest.approx([2.0, 4.0]) == f["roll_max"]
    assert f["heading_sigma"] == pytest.approx([0.0, 0.0])  # after whole hours always the same
    assert f["fixed_float_rms"] == pytest.approx(2 * [648000.0 * 2e-7])
    assert f["fixed_float_max"] == pytest.approx(2 * [648000.0 * 3e-7])
    pooled = runs.pooled()
    assert pooled["pitch_rms"] == pytest.approx(np.sqrt(2.5)) and pooled["pitch_max"] == 2.0
    assert pooled["eigenvalue_min"] == 300.0 and pooled["saturated_sum"] == 7.0
    assert pooled["used_sum"] == 80.0 and pooled["refused_sum"] == 8.0
    assert pooled["scale_up_ppm"] == pytest.approx(20.0)


def test_hours(told) -> None:
    """After each whole hour; the deviation is about their mean, of n - 1."""
    result = told(1.0)
    result.error[[3749, 7499]] = [[1.0, 0.0, 5.0], [3.0, 0.0, 1.0]]
    assert result.hourly.tolist() == [[1.0, 0.0, 5.0], [3.0, 0.0, 1.0]]
    assert figures_of([result]).figures["heading_sigma"] == pytest.approx(np.sqrt(8.0))
    short = dataclasses.replace(result, error=result.error[:100])
    assert short.hourly.tolist() == result.error[99:100].tolist()


def test_errors_are_those_of_the_samples_that_were_kept() -> None:
    """The truth of the samples themselves is no error; a turn more is none either."""
    world = TurningArray(36.0, hours=0.01)
    truth = world.truth(ERECTED, world.samples)[EVERY - 1 :: EVERY] / np.pi
    outputs = dict(zip(("pitch", "roll", "heading"), truth.T, strict=True))
    outputs["heading"] = outputs["heading"] + np.where(
        np.arange(len(truth)) % 2, 2.0, 1.0 / 648000.0
    )
    error = errors_of(world, outputs)
    assert np.abs(error[:, :2]).max() < 1e-6
    assert error[:, 2] == pytest.approx(np.where(np.arange(len(truth)) % 2, 0.0, 1.0), abs=1e-6)


@pytest.fixture(scope="module")
def short():
    """Six turns at 36 deg/s, after the alignment."""
    case = dataclasses.replace(CASES["b_index"], hours=1.0 / 60.0)
    return run_array(case, range(2, 3))


def test_a_short_run(short) -> None:
    """The mark is used in every turn; the errors are seconds of arc, float64 hundredths away."""
    f = {name: float(v[0]) for name, v in short.figures.items()}
    assert f["used_sum"] == 6.0 and f["refused_sum"] == 0.0 == f["saturated_sum"]
    assert 0.0 < f["fixed_float_max"] < 0.3 and f["eigenvalue_min"] > 256.0
    assert f["pitch_rms"] < 10.0 and f["roll_rms"] < 20.0
    (result,) = short.each
    assert np.abs(result.error[-1, 2]) < 3.0 and result.records == 1 + ERECTED + 6000


@pytest.mark.parametrize("seed", [2, 3])
def test_what_stays_of_a_run(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """That of the whole run, whatever the pieces are; shorter words clamp and are further off."""
    monkeypatch.setattr(world_of_arrays, "_PIECE", {2: 7001, 3: 20_000}[seed])
    world = TurningArray(36.0, seed, hours=1.0 / 120.0)
    build = Build(ArrayAttitude(), word=28)
    result = turned(world, build, compared=True, watched=True)
    loop, outputs = close_loop(world, make_level("c", build)), build.estimators[0].outputs
    real = make_level("float", build).run(loop.inputs).outputs
    status = loop.outputs["status"].astype(int)
    assert result.records == len(loop.inputs) == 1 + ERECTED + 3000
    assert result.saturated == loop.run.n_saturated
    assert result.used == (status >> 6 & 1).sum() > 0 and result.refused == (status >> 3 & 1).sum()
    for name, values in result.outputs.items():
        np.testing.assert_array_equal(values, loop.outputs[name][ERECTED + EVERY :: EVERY])
    for d in differences(outputs, loop.outputs, {name: real[name] for name in ANGLES}):
        assert result.largest[d.output] == d.largest > 0.0
        assert result.square[d.output] == pytest.approx(d.rms**2, rel=1e-9)
    assert loop.run.states is not None
    p = covariance_of(build.estimators[0]).of_words(build.programs[0], loop.run.states[-1:])
    assert 0.0 < result.least_eigenvalue <= np.linalg.eigvalsh(p).min()
    plain = turned(world, build)
    assert (plain.largest, plain.square, plain.least_eigenvalue) == ({}, {}, np.inf)
