"""`sim.accuracy.benchmark`: side by side is the same as one by one; figures against truth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import State
from boresight.model.estimators import ESTIMATORS
from boresight.model.estimators.complementary import Complementary
from boresight.sim.accuracy.benchmark import Trial, batches, benchmark, run_float_batch
from boresight.sim.accuracy.peers import PEERS, dip_rad
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.attitude.accuracy import attitude_error, attitude_rmse
from boresight.sim.attitude.feed import attitude_of, inputs_of, named_outputs
from boresight.sim.worlds.synthetic import SensorError, synthetic_log


def noisy(seconds, seed):
    return synthetic_log(
        seconds=seconds,
        rate_hz=50,
        seed=seed,
        name=f"log{seed}",
        acceleration=0.5,
        gyr_error=SensorError(0.01),
        acc_error=SensorError(0.1),
        mag_error=SensorError(0.5),
    )


@pytest.fixture(scope="module")
def trials():
    logs = [noisy(4, 1), noisy(6, 2), noisy(5, 3)]
    return [Trial(log, "truth", log.q) for log in logs]


def test_batches():
    assert batches([10, 100, 60, 49, 9, 5]) == [[1, 2], [3], [0, 4, 5]]
    assert batches([7, 7, 7]) == [[0, 1, 2]]
    assert batches([]) == []


def test_a_padded_run_is_the_run_alone(trials):
    estimator = Complementary()
    inputs = [inputs_of(estimator, t.log) for t in trials]
    params = {"kp_heading_per_s": 0.7}
    together = run_float_batch(estimator, inputs, params)
    for x, outputs in zip(inputs, together, strict=True):
        alone = estimator.run_float(x[:, :, None], params=params).outputs
        assert set(outputs) == set(alone)
        for name, y in alone.items():
            assert outputs[name].shape == (len(x),)
            assert np.allclose(outputs[name], y[:, 0], rtol=0, atol=1e-12), name


def test_figures_are_those_of_plain_runs(trials):
    lines = []
    results = benchmark(
        ["complementary"],
        ["vqf"],
        trials,
        jobs=1,
        progress=lines.append,
        params={"complementary": {"kp_heading_per_s": 0.7}},
    )
    assert [(r.estimator, r.level, r.trial) for r in results] == [
        (name, level, t.log.name)
        for name, level in (
            ("complementary", "fixed"),
            ("complementary", "float"),
            ("vqf", "package"),
        )
        for t in trials
    ]
    assert lines[0].startswith("2 runs; the float reference makes 300 steps over 3 logs")
    assert [line.split(",")[0] for line in lines[1:]] == ["[1/2] complementary", "[2/2] vqf"]
    scorer = Scorer(Complementary(), [t.log for t in trials])
    runs = {
        t.log.name: run
        for t, run in zip(trials, scorer.runs({"kp_heading_per_s": 0.7}), strict=True)
    }
    for fixed, floating, t in zip(results[:3], results[3:6], trials, strict=True):
        run = Complementary().run_float(
            inputs_of(Complementary(), t.log)[:, :, None], params={"kp_heading_per_s": 0.7}
        )
        q = attitude_of({k: v[:, 0] for k, v in run.outputs.items()})
        assert floating.rmse == pytest.approx(attitude_rmse(q, t.log.q))
        assert fixed.rmse == pytest.approx(floating.rmse, abs=1e-3)
        assert fixed.rmse != floating.rmse
        words = runs[t.log.name].outputs
        apart = attitude_error(attitude_of(named_outputs(scorer.program, words)), q).total
        assert fixed.vs_float.max_deg == pytest.approx(apart.max())
        assert 0 < fixed.vs_float.max_deg < 1e-3
        assert fixed.vs_float.status_changed == 0 == fixed.saturated
        assert floating.vs_float is None
    for got, t in zip(results[6:], trials, strict=True):
        assert got.rmse == attitude_rmse(PEERS["vqf"].run(t.log), t.log.q)


def test_narrow_words_show(trials):
    wide, narrow = (
        benchmark(["complementary"], [], trials[:1], word=word, jobs=1)[0] for word in (32, 18)
    )
    assert narrow.vs_float.max_deg > 100 * wide.vs_float.max_deg


class Odd(Complementary):
    """Saturates from its fourth update on; float does not, and says less, then more, of it."""

    name = "odd"
    states = (*Complementary.states, State("fill", 0.0, 0.75, ""))

    def step(self, x, u, p):
        after, out = super().step(x, u, p)
        after["fill"] = x.fill + 0.25
        said = ops.where(x.fill > 0.9, ops.where(x.fill > 5.0, 2048.0, 512.0), 1024.0)
        return after, out | {"status": out["status"] + said}


def test_saturation_and_status_are_counted(trials, monkeypatch):
    monkeypatch.setitem(ESTIMATORS, "odd", Odd)
    for result, t in zip(benchmark(["odd"], [], trials, jobs=1), trials, strict=False):
        assert result.saturated == len(t.log) - 3
        assert result.vs_float.status_changed == len(t.log) - 4


def test_reference_and_samples_that_count(trials):
    log = trials[1].log
    mov = np.arange(len(log)) > 100
    moved = Trial(dataclasses.replace(log, mov=mov), "truth", log.q)
    q = np.roll(log.q, 1, axis=0)
    wanted = np.sqrt(np.mean(attitude_error(q[101:], log.q[101:]).total ** 2))
    assert moved.rmse(q).total == pytest.approx(wanted)
    q[150] = 0.0
    assert np.isnan(moved.rmse(q).total)


def test_the_dip_is_of_the_folder(trials):
    """A log whose own field dips elsewhere gets the dip of its folder's logs."""
    odd = dataclasses.replace(trials[0].log, name="odd", mag=trials[0].log.mag * [1, 1, 0.5])
    alone, among = (
        benchmark([], ["ahrs_ekf"], [Trial(odd, "truth", trials[0].q, "f"), *others], jobs=1)[
            0
        ].rmse
        for others in ((), [dataclasses.replace(t, folder="f") for t in trials])
    )
    place = np.median([dip_rad(log) for log in (odd, *(t.log for t in trials))])
    assert alone != among
    for got, dip in ((alone, None), (among, place)):
        assert got == attitude_rmse(PEERS["ahrs_ekf"].run(odd, dip), odd.q)


def test_float_can_be_left_out(trials):
    results = benchmark(["complementary"], [], trials[:1], with_float=False, jobs=1)
    assert [r.level for r in results] == ["fixed"]
    assert results[0].vs_float is None and results[0].saturated == 0


def test_processes_give_the_same(trials):
    one, two = (
        benchmark(["complementary"], ["madgwick", "vqf"], trials[:2], jobs=jobs) for jobs in (1, 2)
    )
    assert [dataclasses.replace(r, seconds=0.0) for r in one] == [
        dataclasses.replace(r, seconds=0.0) for r in two
    ]


def test_bad_names(trials):
    with pytest.raises(InputError, match="kalman"):
        benchmark(["kalman"], [], trials)
    with pytest.raises(InputError, match="wanted one of vqf_offline"):
        benchmark([], ["kalman"], trials)
    with pytest.raises(InputError, match="wanted 0 to 32"):
        benchmark(["complementary"], [], trials, params={"complementary": {"kp_pitch_per_s": 99.0}})
