"""Two-radar registration: the paper's table and figures, compared with the bound."""

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
from boresight.sim.experiments.targets import render, targets_of
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.plotting import Section, histories
from boresight.sim.worlds.loop import close_loop
from boresight.systems.radar.estimator import BIASES, Registration
from boresight.systems.radar.world import NOISE, TwoRadars, covariances, deviations, information

UNITS = np.array([1.0, math.pi / 180.0, math.pi / 180.0] * 2)  #: m and rad of m and deg.
FREE = (1e4, 15.0)  #: P0 of the noise-free reading [m, deg].
NOISY = (50.0, 0.5)  #: P0 with noise.
#: Further values of P0, for the difference of fixed point and float64.
OTHERS = ((50.0, 0.5), (1e3, 1.0), (1e3, 10.0), (1e4, 10.0))
AT = 800  #: record at 80 s.
_INTRO = (
    "Two radars, registered by their tracks: Cui, Zhang, Wang (2014) claim 99 % of the angles and "
    "97 % of the ranges after 80 s. Without noise these figures come out; with the printed noise "
    "no unbiased estimator can reach them: at 80 s the bound of an angle is up to "
    "{elevation:.3g} % of the bias where the paper has 1 %. The information has a condition of "
    "{condition:.2g} million at 170 s."
)
_RUNS = (
    "The runs have the printed noise and biases and a P0 of 50 m and 0.5 deg about zero. "
    "Normalised innovations squared: {mean:.4g} per degree of freedom, 95 % of {band[0]:.4g} to "
    "{band[1]:.4g}."
)
_COLUMNS = {
    **{"noise-free": "percent", "noise-free, 170 s": "170s_percent"},
    **{"bound, printed noise": "bound_percent", "bound, 170 s": "bound_170s_percent"},
}
_BIASES = (
    "Figures 2 to 4: errors without noise in percent of the bias; what no unbiased estimator "
    "can beat with the printed noise and no prior, and the spread of the filter with its prior."
)
_TRACKS = (
    "Figures 5 to 10 without noise: reported less true position, corrected from 80 s on. At 80 s "
    "the printed biases make errors of {} m (radar 1: x, y, z) and {} m (radar 2)."
)


class Radar(Experiment):
    """Registration of two radars without feedback, Cui et al. (2014)."""

    runs = 500
    pages = ("radar.html",)

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
        intro = _INTRO.format(
            elevation=metrics["registration_elevation_1_bound_percent"],
            condition=1e-6 * theory.condition,
        )
        page = render("radar", [intro], goals, _sections(noiseless, theory, spread, metrics))
        return ExperimentResult(
            figures=metrics,
            targets=goals,
            details={"fixed_float_percent": deviation},
            pages={"radar.html": page},
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


def _sections(
    noiseless: Watched, theory: Predicted, spread: Mapping[str, Any], metrics: Mapping[str, float]
) -> list[Section]:
    """The table at 80 s; Figures 2 to 10 without noise."""
    share = 100.0 / np.abs(TwoRadars(noise=0.0, seconds=1.0).bias)
    reported = [", ".join(f"{abs(x):.0f}" for x in row) for row in noiseless.before[AT]]
    biases: dict[str, dict[str, FloatArray]] = {}
    for k, b in enumerate(BIASES):
        kind, radar = b.split("_")
        biases.setdefault(f"{kind}, %", {}).update(
            {
                f"radar {radar}": 100.0 * np.abs(noiseless.error[:, k]),
                f"bound {radar}": share[k] * theory.free[:, k],
                f"spread {radar}": share[k] * theory.sd[:, k],
            }
        )
    curves = {"reported": noiseless.before, "corrected": noiseless.after}
    tracks = {
        f"radar {i + 1}, {axis}, m": {name: curve[:, i, k] for name, curve in curves.items()}
        for i in range(2)
        for k, axis in enumerate("xyz")
    }
    plots = [
        (_BIASES, histories(biases, step_s=0.1, log=True, name="biases")),
        (_TRACKS.format(*reported), histories(tracks, step_s=0.1, log=False, name="tracks")),
    ]
    rows: list[list[str | float]] = []
    for k, b in enumerate(BIASES):
        of = spread["outputs"][f"{b}_bias"]
        sd, mean, band = (of[key][-1] * share[k] for key in ("sd", "mean", "mean_band"))
        row = [metrics[f"registration_{b}_{key}"] for key in _COLUMNS.values()]
        row += [sd, theory.sd[AT, k] * share[k], mean, theory.mean[AT, k] * share[k], band]
        rows.append([b.replace("_", " radar "), *map(float, row)])
    runs = f"spread of {spread['runs']} runs"
    columns = ("bias", *_COLUMNS, runs, "theory", "mean error", "theory", "\N{PLUS-MINUS SIGN}")
    title, text = "At 80 s, in percent of the bias", _RUNS.format(**spread["nis"])
    return [
        Section(title=title, text=text, columns=columns, rows=rows),
        Section(title="Figures", figures=plots),
    ]
