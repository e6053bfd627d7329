"""Two-radar registration: the paper's table and figures, and what the bound says of them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from boresight.gateware.core import build_core
from boresight.gateware.machine import CONFIGS
from boresight.model.estimators.radar.interface import BIASES
from boresight.model.estimators.radar.registration import Registration
from boresight.sim.experiments.experiment import Experiment, Result, Target
from boresight.sim.experiments.radar.page import render
from boresight.sim.experiments.radar.runs import Predicted, Watched, first, predicted, watch
from boresight.sim.montecarlo.campaign import Campaign
from boresight.sim.montecarlo.deal import complete
from boresight.sim.montecarlo.figures import figures as judged
from boresight.sim.montecarlo.journal import Journal
from boresight.sim.worlds.radar import world as worlds
from boresight.sim.worlds.radar.world import TwoRadars

__all__ = ["FREE", "NOISY", "Radar"]

FREE = (1e4, 15.0)  #: P0 of the noise-free reading [m, deg].
NOISY = (50.0, 0.5)  #: P0 with noise.
#: Further values of P0, for the difference of fixed point and float64.
OTHERS = ((50.0, 0.5), (1e3, 1.0), (1e3, 10.0), (1e4, 10.0))
AT = 800  #: record at 80 s.
#: What the paper says of 80 s: accuracy of the biases, and errors of the tracks before [m].
PRINTED = (3.0, 1.0, 1.0, 3.0, 1.0, 1.0)


class Radar(Experiment):
    """Registration of two radars without feedback, Cui et al. (2014)."""

    runs = 500
    pages = ("radar.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`."""
        say("tracks without noise")
        free = watch(TwoRadars(noise=0.0, seconds=170.0), first(*FREE))
        say("tracks with the printed noise")
        noisy = watch(TwoRadars(seed=seed, seconds=170.0), first(*NOISY))
        apart = {
            f"{m:g} m, {d:g} deg": 100.0 * watch(TwoRadars(noise=0.0), first(m, d)).apart
            for m, d in (FREE, *OTHERS)
        }
        theory = predicted(TwoRadars(seconds=170.0), *NOISY)
        say(f"{runs} runs with the printed noise")
        spread = campaign(seed, runs, say, self.jobs)
        found = figures(free, noisy, theory, spread, apart)
        for config in CONFIGS:
            core = build_core(Registration().compile(), config)
            found[f"registration_interval_cycles_{config}"] = float(core.schedule.interval)
        goals = targets(found)
        return Result(
            figures=found,
            targets=goals,
            details={"fixed_float_percent": apart, "weak": theory.weak.tolist()},
            pages={"radar.html": render(free, noisy, theory, spread, found, goals)},
        )


def campaign(
    seed: int, runs: int, say: Callable[[str], None], jobs: int | None = None
) -> dict[str, Any]:
    """Monte-Carlo of the printed noise and biases up to 80 s, on the integer C."""
    where = f"{Path(worlds.__file__)}:TwoRadars"
    asked = Campaign(where, "registration", tuple(sorted(first(*NOISY).items())))
    jobs = jobs or os.cpu_count() or 1
    with tempfile.TemporaryDirectory(prefix="boresight-") as folder:
        journal = Journal(Path(folder) / "runs", asked.identity())
        draws = complete(asked, range(seed, seed + runs), journal, say=say, jobs=jobs)
    return judged(draws, {}, Registration.nis_freedom)


def figures(
    free: Watched,
    noisy: Watched,
    theory: Predicted,
    spread: Mapping[str, Any],
    apart: Mapping[str, float],
) -> dict[str, float]:
    """Every number, by name."""
    bias = TwoRadars(noise=0.0, seconds=1.0).bias
    out = {"registration_fixed_float_percent": max(apart.values())}
    for k, b in enumerate(BIASES):
        one = spread["outputs"][f"{b}_bias"]
        sd, mean = one["sd"][-1], one["mean"][-1]
        out |= {
            f"registration_{b}_percent": 100.0 * abs(free.error[AT, k]),
            f"registration_{b}_170s_percent": 100.0 * abs(free.error[-1, k]),
            f"registration_{b}_spread_ratio": sd / theory.sd[AT, k],
            f"registration_{b}_mean_offset": (mean - theory.mean[AT, k]) / one["mean_band"][-1],
            f"registration_{b}_bound_percent": 100.0 * theory.free[AT, k] / bias[k],
            f"registration_{b}_bound_170s_percent": 100.0 * theory.free[-1, k] / bias[k],
            f"registration_{b}_equal_percent": 100.0 * theory.equal[AT, k % 3] / bias[k],
        }
    for i in range(2):
        late = slice(AT + 50, None)
        reduced = [
            np.sqrt(np.nanmean(run.after[late, i] ** 2) / np.nanmean(run.before[late, i] ** 2))
            for run in (free, noisy)
        ]
        out[f"registration_track_{i + 1}_gain_percent"] = 100.0 * (1.0 - reduced[0])
        out[f"registration_track_{i + 1}_gain_noise_percent"] = 100.0 * (1.0 - reduced[1])
    out["registration_condition"] = theory.condition
    out["registration_nis"] = spread["nis"]["mean"]
    out["registration_saturated"] = float(spread["saturated"] + free.saturated + noisy.saturated)
    return {name: float(value) for name, value in out.items()}


def targets(found: Mapping[str, float]) -> tuple[Target, ...]:
    """What is judged; the paper's own numbers stand beside and do not bind."""
    out: list[Target] = []

    def add(name: str, source: str, key: str, unit: str = "%", **limits: Any) -> None:
        out.append(Target(name=name, source=source, value=found[key], unit=unit, **limits))

    for name, source, key, unit, limits in (
        ("noise-free, 80 s", "Table 1", "percent", "%", None),
        ("spread over the bound", "ours", "spread_ratio", "", (1 / 1.15, 1.15)),
        ("mean error, in bands", "ours", "mean_offset", "", (-1.0, 1.0)),
    ):
        for b, printed in zip(BIASES, PRINTED, strict=True):
            low, high = limits or (None, 2.0 if b[0] == "r" else 0.15)
            more: dict[str, Any] = {"part": b.replace("_", " "), "low": low, "high": high}
            more |= {} if limits else {"beside": {"paper": printed}}
            add(name, source, f"registration_{b}_{key}", unit, **more)
    for i in "12":
        part, paper = f"radar {i}", {"paper": 96.0 if i == "1" else 97.0}
        key = f"registration_track_{i}_gain_percent"
        add("tracks better, noise-free", "abstract", key, part=part, low=96.0, beside=paper)
    name = "Table 1, printed noise: bound at 80 s"
    for b, most in zip(BIASES, PRINTED, strict=True):
        more = {"part": b.replace("_", " "), "high": most, "note": "no estimator can"}
        add(name, "Table 1", f"registration_{b}_bound_percent", binding=False, **more)
    add("fixed less float64", "ours", "registration_fixed_float_percent", high=0.1)
    add("words beyond their range", "ours", "registration_saturated", "", high=0.0)
    for config, most in (("small", 1340.0), ("fast", 760.0)):
        key = f"registration_interval_cycles_{config}"
        add("cycles to the next record", "ours", key, "", part=config, high=most)
    return tuple(out)
