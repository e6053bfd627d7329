"""Two-radar registration: the paper's table, compared with the bound."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import boresight
from boresight import Experiment, ExperimentResult
from boresight.model.arrays import FloatArray
from boresight.sim.compare.difference import differences
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.targets import targets_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.radar.estimator import BIASES, Registration
from boresight.systems.radar.world import NOISE, TwoRadars, covariances, deviations, information

UNITS = np.array([1.0, math.pi / 180.0, math.pi / 180.0] * 2)  #: m and rad of m and deg.
FREE = (1e4, 15.0)  #: P0 of the noise-free reading [m, deg].
NOISY = (50.0, 0.5)  #: P0 with noise.
#: Further values of P0, for the difference of fixed point and float64.
OTHERS = ((50.0, 0.5), (1e3, 1.0), (1e3, 10.0), (1e4, 10.0))
AT = 800  #: record at 80 s.
_COLUMNS = {
    **{"noise-free": "percent", "noise-free, 170 s": "170s_percent"},
    **{"bound, printed noise": "bound_percent", "bound, 170 s": "bound_170s_percent"},
}


class Radar(Experiment):
    """Registration of two radars without feedback, Cui et al. (2014)."""

    runs = 500

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        say("tracks without noise")
        noiseless = watch(TwoRadars(noise=0.0, seconds=170.0), first(*FREE))
        theory = predicted(TwoRadars(seconds=170.0), *NOISY)
        deviation = {
            f"{m:g} m, {d:g} deg": 100.0 * watch(TwoRadars(noise=0.0), first(m, d)).deviation
            for m, d in (FREE, *OTHERS)
        }
        say(f"{runs} runs with the printed noise")
        with tempfile.TemporaryDirectory(prefix="boresight-") as folder:
            spread = boresight.montecarlo(
                *("two_radars", "registration"),
                runs=runs,
                seed=seed,
                params=first(*NOISY),
                jobs=self.jobs,
                output=folder,
                progress=say,
            ).to_json()
        metrics = figures(noiseless, theory, spread)
        metrics["registration_fixed_float_percent"] = max(deviation.values())
        for config, (schedule,) in schedules_of(Registration()).items():
            metrics[f"registration_interval_cycles_{config}"] = float(schedule.interval)
        goals = targets_of("boresight.systems.radar", metrics, runs=runs)
        return ExperimentResult(
            figures=metrics,
            targets=goals,
            details={"fixed_float_percent": deviation},
            tables={"at 80 s, in percent of the bias": _rows(theory, spread, metrics)},
        )


def first(range_m: float, angle_deg: float) -> dict[str, float]:
    """Parameters of a P0 [m, deg]."""
    wanted = [range_m, angle_deg, angle_deg] * 2
    return {f"p0_{b}": w / n for b, w, n in zip(BIASES, wanted, NOISE, strict=True)}


@dataclass(frozen=True, eq=False)
class Watched:
    """A run: errors of the biases (n, 6) in shares of the bias; tracks less target (n, 2, 3) [m].

    ``before`` as reported, ``after`` as the filter gives them; NaN where a radar missed.
    ``saturated``: updates with a word beyond its range; ``deviation``: largest share by which fixed
    point differs from float64 at the last record.
    """

    error: FloatArray
    before: FloatArray
    after: FloatArray
    saturated: int
    deviation: float


def watch(world: TwoRadars, params: Mapping[str, float]) -> Watched:
    """Run a world on the integer C, and on float64."""
    build = Build(Registration(), params=[params])
    loop = close_loop(world, make_level("c", build))
    reference = make_level("float", build).run(loop.inputs)
    names = [f"{b}_bias" for b in BIASES]
    biases = np.stack([loop.outputs[n] for n in names], axis=1)
    declared = [o for o in build.estimators[0].outputs if o.name in names]
    errors = [d.apart[-1] for d in differences(declared, loop.outputs, reference.outputs)]
    tracks = np.array([[loop.outputs[f"{a}{i}_corrected"] for a in "xyz"] for i in "12"])
    return Watched(
        (biases - world.bias) / world.bias,
        world.reported.transpose(1, 0, 2) - world.place[:, None],
        tracks.transpose(2, 0, 1) - world.place[:, None],
        loop.run.n_saturated,
        float((errors / np.abs(world.bias)).max()),
    )


@dataclass(frozen=True, eq=False)
class Predicted:
    """Theory after each record (n, 6), in the biases' units.

    ``free``: bound without a prior; ``sd``, ``mean``: spread and mean error of the best linear
    filter at biases that are given, of which a prior around zero takes its share; ``condition`` of
    the information at the last record.
    """

    free: FloatArray
    sd: FloatArray
    mean: FloatArray
    condition: float


def predicted(world: TwoRadars, range_m: float, angle_deg: float) -> Predicted:
    """Theory of a world and a prior."""
    noise, jacobians = np.array(NOISE) * UNITS, world.jacobians()
    prior = np.array([range_m, angle_deg, angle_deg] * 2) * UNITS
    fisher = information(jacobians, noise)
    p = covariances(jacobians, noise, prior)
    return Predicted(
        deviations(covariances(jacobians, noise, np.full(6, np.inf))),
        deviations(p @ fisher @ p),
        -np.einsum("nij,j->ni", p, world.bias / prior**2),
        float(np.linalg.cond(fisher[-1] * np.outer(noise, noise))),
    )


def figures(noiseless: Watched, theory: Predicted, spread: Mapping[str, Any]) -> dict[str, float]:
    """Figures of the runs and their theory, by name."""
    share = 100.0 / np.abs(TwoRadars(noise=0.0, seconds=1.0).bias)
    out = {
        "registration_condition": theory.condition,
        "registration_nis": spread["nis"]["mean"],
        "registration_saturated": spread["saturated"] + noiseless.saturated,
    }
    for k, b in enumerate(BIASES):
        of = spread["outputs"][f"{b}_bias"]
        sd, mean, band = (of[key][-1] for key in ("sd", "mean", "mean_band"))
        for name, value in {
            "percent": 100.0 * abs(noiseless.error[AT, k]),
            "170s_percent": 100.0 * abs(noiseless.error[-1, k]),
            "spread_ratio": sd / theory.sd[AT, k],
            "mean_offset": (mean - theory.mean[AT, k]) / band,
            "bound_percent": share[k] * theory.free[AT, k],
            "bound_170s_percent": share[k] * theory.free[-1, k],
        }.items():
            out[f"registration_{b}_{name}"] = value
    late = slice(AT + 50, None)
    for i in range(2):
        after, before = (np.nanmean(x[late, i] ** 2) for x in (noiseless.after, noiseless.before))
        out[f"registration_track_{i + 1}_gain_percent"] = 100.0 * (1.0 - math.sqrt(after / before))
    return {name: float(value) for name, value in out.items()}


def _rows(
    theory: Predicted, spread: Mapping[str, Any], metrics: Mapping[str, float]
) -> list[dict[str, Any]]:
    """The table at 80 s: errors without noise, bounds, runs with the printed noise."""
    share = 100.0 / np.abs(TwoRadars(noise=0.0, seconds=1.0).bias)
    rows = []
    for k, b in enumerate(BIASES):
        of = spread["outputs"][f"{b}_bias"]
        sd, mean, band = (of[key][-1] * share[k] for key in ("sd", "mean", "mean_band"))
        row = {head: metrics[f"registration_{b}_{key}"] for head, key in _COLUMNS.items()}
        row |= {f"spread of {spread['runs']} runs": sd, "theory": theory.sd[AT, k] * share[k]}
        row |= {"mean error": mean, "theory of it": theory.mean[AT, k] * share[k], "+-": band}
        rows.append({"bias": b.replace("_", " radar "), **row})
    return rows
