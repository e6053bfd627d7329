"""`sim.accuracy.benchmark`: side by side is the same as one by one; figures against truth."""

from __future__ import annotations

import dataclasses
import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.attitude.complementary import Complementary
from boresight.model.errors import InputError
from boresight.model.estimator import State
from boresight.sim.accuracy.benchmark import benchmark
from boresight.sim.accuracy.peers import PEERS, dip_rad, run_peer
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.trials import Trial
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records import feed as feed_module
from boresight.sim.records.feed import feed
from boresight.sim.records.log import Log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error, attitude_rmse
from boresight.sim.rotations.outputs import attitude_of


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
    return [Trial(Log.in_memory(log)) for log in logs]


def fed(trial):
    return feed(Complementary(), trial.record)


def reference(trial):
    return NineAxis.of(trial.record).attitude


@pytest.mark.parametrize("align", ["none", "heading"])
def test_pieces_give_the_same_figures(trials, monkeypatch, align):
    def made():
        results = benchmark([Complementary()], [], trials, jobs=2, align=align)
        return [dataclasses.replace(r, seconds=0.0, errors={}, offset_deg=()) for r in results], [
            [*r.errors.values(), *r.offset_deg] for r in results
        ]

    rest, figures = made()
    monkeypatch.setattr(feed_module, "ROWS", 60)
    again, others = made()
    assert again == rest
    assert others == (figures if align == "none" else [pytest.approx(f) for f in figures])


def test_seconds_are_those_of_each_run(trials, monkeypatch):
    """On a clock that counts its readings each run takes one, whatever its length."""
    clock = SimpleNamespace(perf_counter=itertools.count().__next__)
    monkeypatch.setattr("boresight.sim.worlds.loop.time", clock)
    results = benchmark([Complementary()], [], trials, jobs=1)
    assert [r.seconds for r in results] == [1] * 6


def test_figures_are_those_of_plain_runs(trials):
    lines = []
    params = {"kp_heading_per_s": 0.7}
    results = benchmark(
        [Complementary()],
        ["vqf_online"],
        trials,
        jobs=1,
        progress=lines.append,
        params={"complementary": params},
    )
    levels = (("complementary", "fixed"), ("complementary", "float"), ("vqf_online", "package"))
    assert [(r.estimator, r.level, r.trial) for r in results] == [
        (name, level, t.name) for name, level in levels for t in trials
    ]
    assert [line.split(",")[0] for line in lines] == ["[1/2] complementary", "[2/2] vqf_online"]
    scorer = Scorer(Complementary(), [fed(t) for t in trials])
    runs = scorer.each(lambda k, level: level.run_anew(scorer.feeds[k].inputs), params)
    for fixed, floating, t, run in zip(results[:3], results[3:6], trials, runs, strict=True):
        real = Complementary().run_float(fed(t).inputs[:, :, None], params=params)
        q = attitude_of({k: v[:, 0] for k, v in real.outputs.items()})
        assert floating.errors == pytest.approx(attitude_rmse(q, reference(t))._asdict())
        assert fixed.errors == pytest.approx(floating.errors, abs=1e-3)
        assert fixed.errors != floating.errors
        error = attitude_error(attitude_of(run.outputs), q).total
        near = {d.output: d for d in fixed.near}
        assert near["attitude"].largest == pytest.approx(error.max(), rel=1e-4)
        assert 0 < near["attitude"].largest < 1e-3 and near["attitude"].samples == len(t.record)
        assert near["status"].largest == 0.0 == fixed.saturated
        assert floating.near == () and floating.saturated is None
    for got, t in zip(results[6:], trials, strict=True):
        q = run_peer(PEERS["vqf_online"], t.record)
        assert got.errors == attitude_rmse(q, reference(t))._asdict()


def test_narrow_words_show(trials):
    wide, narrow = (
        benchmark([Complementary()], [], trials[:1], word=word, jobs=1)[0] for word in (32, 18)
    )
    turns = [next(d for d in r.near if d.output == "attitude") for r in (wide, narrow)]
    assert turns[1].largest > 100 * turns[0].largest and turns[0].good and not turns[1].good


class Odd(Complementary):
    """Saturates from its fourth update on; float does not, and says less, then more, of it."""

    name = "odd"
    states = (*Complementary.states, State("fill", 0.0, 0.75, ""))

    def step(self, x, u, p):
        after, out = super().step(x, u, p)
        after["fill"] = x.fill + 0.25
        said = ops.where(x.fill > 0.9, ops.where(x.fill > 5.0, 2048.0, 512.0), 1024.0)
        return after, out | {"status": out["status"] + said}


def test_saturation_and_status_are_counted(trials):
    for result, t in zip(benchmark([Odd()], [], trials, jobs=1), trials, strict=False):
        assert result.saturated == len(t.record) - 3
        status = next(d for d in result.near if d.output == "status")
        assert status.rms**2 * status.samples == pytest.approx(len(t.record) - 4)


def test_samples_that_count(trials):
    log = NineAxis.of(trials[1].record)
    moved = dataclasses.replace(log, mov=np.arange(len(log)) > 100).record()
    got = benchmark([], ["vqf_online"], [Trial(Log.in_memory(moved))], jobs=1)[0].errors
    q = run_peer(PEERS["vqf_online"], moved)
    assert got == attitude_rmse(q[101:], log.attitude[101:])._asdict()


def test_the_dip_is_of_the_folder(trials):
    """A log whose own field dips elsewhere gets the dip of its folder's logs."""
    log = NineAxis.of(trials[0].record)
    odd = dataclasses.replace(log, name="odd", mag=log.mag * [1, 1, 0.5])
    trial = Trial(Log.in_memory(odd.record()), "truth", "f")
    alone, among = (
        benchmark([], ["ahrs_ekf"], [trial, *others], jobs=1)[0].errors
        for others in ((), [dataclasses.replace(t, folder="f") for t in trials])
    )
    place = np.median([dip_rad(x) for x in (odd, *(NineAxis.of(t.record) for t in trials))])
    assert alone != among
    for got, dip in ((alone, None), (among, place)):
        q = PEERS["ahrs_ekf"].run(odd, dip)
        assert got == attitude_rmse(q, odd.attitude)._asdict()


def test_float_can_be_left_out(trials):
    results = benchmark([Complementary()], [], trials[:1], with_float=False, jobs=1)
    assert [r.level for r in results] == ["fixed"]
    assert results[0].near == () and results[0].saturated == 0


def test_processes_give_the_same(trials):
    first, two = (
        benchmark([Complementary()], ["madgwick", "vqf_online"], trials[:2], jobs=jobs)
        for jobs in (1, 2)
    )
    assert [dataclasses.replace(r, seconds=0.0) for r in first] == [
        dataclasses.replace(r, seconds=0.0) for r in two
    ]


def test_what_was_fed_is_not_fed_again(trials, monkeypatch):
    held = [dataclasses.replace(t, feeds={"complementary": t.fed(Complementary())}) for t in trials]
    monkeypatch.setattr("boresight.sim.accuracy.trials.feed_of", None)
    assert benchmark([Complementary()], [], held, with_float=False, jobs=1)


def test_bad_names(trials):
    with pytest.raises(InputError, match="wanted one of 9 names, nearest: mahony"):
        benchmark([], ["kalman"], trials)
    with pytest.raises(InputError, match="wanted 0 to 32"):
        benchmark([Complementary()], [], trials, params={"complementary": {"kp_pitch_per_s": 99.0}})


class Rated(Complementary):
    """Wants to know the rate, and tells by its gain that it does."""

    name = "rated"
    rates_hz = {"dt": 50.0}

    def for_rates(self, rates_hz):
        made = Rated()
        made.rates_hz = {"dt": round(rates_hz["dt"])}
        made.params = tuple(
            dataclasses.replace(p, default=0.7) if p.name == "kp_heading_per_s" else p
            for p in Complementary.params
        )
        return made


def test_each_rate_has_an_estimator_of_its_own(trials):
    quick = Trial(Log.in_memory(synthetic_log(seconds=3, rate_hz=100, seed=9, name="quick")))
    made = benchmark([Rated()], [], [trials[0], quick, trials[1]], jobs=1)
    assert [(r.level, r.trial) for r in made] == [
        (level, name) for level in ("fixed", "float") for name in ("log1", "quick", "log2")
    ]
    wanted = benchmark(
        [Complementary()],
        [],
        [trials[0], quick, trials[1]],
        jobs=1,
        params={"complementary": {"kp_heading_per_s": 0.7}},
    )
    assert [r.errors for r in made] == [r.errors for r in wanted]
