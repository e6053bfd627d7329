"""Two-radar registration: the paper's table and figures, compared with the bound."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

import boresight
from boresight import Experiment, ExperimentResult
from boresight.sim.campaign import dispatch
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.radar.estimator import Registration
from boresight.systems.radar.interface import BIASES
from boresight.systems.radar.page import render
from boresight.systems.radar.runs import Predicted, Watched, first, predicted, watch
from boresight.systems.radar.world import TwoRadars

FREE = (1e4, 15.0)  #: P0 of the noise-free reading [m, deg].
NOISY = (50.0, 0.5)  #: P0 with noise.
#: Further values of P0, for the difference of fixed point and float64.
OTHERS = ((50.0, 0.5), (1e3, 1.0), (1e3, 10.0), (1e4, 10.0))
AT = 800  #: record at 80 s.
SHOWN_OF = 9  #: runs of which the one with the median error is shown.


class Radar(Experiment):
    """Registration of two radars without feedback, Cui et al. (2014)."""

    runs = 500
    pages = ("radar.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        say("tracks without noise")
        noiseless = watch(TwoRadars(noise=0.0, seconds=170.0), first(*FREE))
        theory = predicted(TwoRadars(seconds=170.0), *NOISY)
        say("tracks with the printed noise")
        noisy = typical(seed, min(runs, SHOWN_OF), theory, self.jobs)
        differences = {
            f"{m:g} m, {d:g} deg": 100.0 * watch(TwoRadars(noise=0.0), first(m, d)).deviation
            for m, d in (FREE, *OTHERS)
        }
        say(f"{runs} runs with the printed noise")
        spread = campaign(seed, runs, say, self.jobs)
        metrics = figures(noiseless, noisy, theory, spread, differences)
        for config, (schedule,) in schedules_of(Registration()).items():
            metrics[f"registration_interval_cycles_{config}"] = float(schedule.interval)
        goals = targets_of("boresight.systems.radar", metrics, runs=runs)
        return ExperimentResult(
            figures=metrics,
            targets=goals,
            details={"fixed_float_percent": differences, "weak": theory.weak.tolist()},
            pages={"radar.html": render(noiseless, noisy, theory, spread, metrics, goals)},
        )


def typical(seed: int, runs: int, theory: Predicted, jobs: int | None = None) -> Watched:
    """Return the run with noise whose mean square error over the predicted spread is the median."""
    bias = TwoRadars(noise=0.0, seconds=1.0).bias
    tasks = [((), _noisy, (k,)) for k in range(seed, seed + runs)]
    watched = [run for _, run in dispatch(jobs, tasks)]
    watched.sort(
        key=lambda run: float(np.mean(((run.error * bias - theory.mean) / theory.sd) ** 2))
    )
    return watched[runs // 2]


def _noisy(seed: int) -> Watched:
    return watch(TwoRadars(seed=seed, seconds=170.0), first(*NOISY))


def campaign(
    seed: int, runs: int, say: Callable[[str], None], jobs: int | None = None
) -> dict[str, Any]:
    """Monte-Carlo of the printed noise and biases up to 80 s, on the integer C, as plain data."""
    with tempfile.TemporaryDirectory(prefix="boresight-") as folder:
        result = boresight.montecarlo(
            "two_radars",
            "registration",
            runs=runs,
            seed=seed,
            params=first(*NOISY),
            jobs=jobs,
            output=folder,
            progress=say,
        )
    return result.to_json()


def figures(
    noiseless: Watched,
    noisy: Watched,
    theory: Predicted,
    spread: Mapping[str, Any],
    differences: Mapping[str, float],
) -> dict[str, float]:
    """Every number, by name."""
    bias = TwoRadars(noise=0.0, seconds=1.0).bias
    out = {"registration_fixed_float_percent": max(differences.values())}
    for k, b in enumerate(BIASES):
        spread_of = spread["outputs"][f"{b}_bias"]
        sd, mean = spread_of["sd"][-1], spread_of["mean"][-1]
        out |= {
            f"registration_{b}_percent": 100.0 * abs(noiseless.error[AT, k]),
            f"registration_{b}_170s_percent": 100.0 * abs(noiseless.error[-1, k]),
            f"registration_{b}_spread_ratio": sd / theory.sd[AT, k],
            f"registration_{b}_mean_offset": (mean - theory.mean[AT, k])
            / spread_of["mean_band"][-1],
            f"registration_{b}_bound_percent": 100.0 * theory.free[AT, k] / bias[k],
            f"registration_{b}_bound_170s_percent": 100.0 * theory.free[-1, k] / bias[k],
            f"registration_{b}_equal_percent": 100.0 * theory.equal[AT, k % 3] / bias[k],
        }
    for i in range(2):
        late = slice(AT + 50, None)
        reduced = [
            np.sqrt(np.nanmean(run.after[late, i] ** 2) / np.nanmean(run.before[late, i] ** 2))
            for run in (noiseless, noisy)
        ]
        out[f"registration_track_{i + 1}_gain_percent"] = 100.0 * (1.0 - reduced[0])
        out[f"registration_track_{i + 1}_gain_noise_percent"] = 100.0 * (1.0 - reduced[1])
    out["registration_condition"] = theory.condition
    out["registration_nis"] = spread["nis"]["mean"]
    out["registration_saturated"] = spread["saturated"] + noiseless.saturated + noisy.saturated
    return {name: float(value) for name, value in out.items()}
