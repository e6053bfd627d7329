"""The landing-system array: Figures 3 to 7 of the paper, with figures of our own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from boresight import Experiment, ExperimentResult
from boresight.sim.experiments.forms import differences_of, run_forms, schedules_of
from boresight.sim.experiments.seeds import run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.mls.cases import CASES
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.linear_array import Array
from boresight.systems.mls.page import render
from boresight.systems.mls.patterns import patterns_of
from boresight.systems.mls.phases import ArrayPhases
from boresight.systems.mls.runs import AXES, GLIDE_DEG, flown, pooled

FEW = 10  #: most runs of cases that only illustrate.
AT_ONCE = 50  #: runs of one task.
COMPARED = ("corrected", "picard_4", "bias", "rolling", "sea_5")  #: fixed with float.


def phases_fixed_float(seed: int, axis: str = "y", count: int = 4000) -> float:
    """Largest difference of the core's phases from float64 [turns], at any attitude."""
    rng = np.random.default_rng([seed, 64])
    parts = [rng.normal(size=(count, n)) for n in (4, 3)]
    u = np.concatenate([x / np.linalg.norm(x, axis=1, keepdims=True) for x in parts], axis=1)
    (c,), (real,) = run_forms(ArrayPhases(axis=axis), [u])
    names = [name for name in c.outputs if name != "status"]
    return float(np.abs(differences_of(c.outputs, real.outputs, names, 1.0)).max())


class Mls(Experiment):
    """Landing-system array on a moving deck, Wang Ding et al. (2018)."""

    pages = ("mls.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        """See `Experiment`; four patterns for each run, at least 40; some cases have ten runs."""
        draws = 4 * max(runs, FEW)  # half of the pulses may be at a wrong place; of few, all
        largest = max(phases_fixed_float(seed, axis) for axis in "yz")
        patterns, figures = {}, {"phases_fixed_float_turns": largest}
        for elements in (64, 16):
            say(f"patterns of {elements} elements")
            patterns[elements] = patterns_of(Array(elements), GLIDE_DEG, draws, seed)
            for name, trial in patterns[elements].items():
                figures |= {f"array{elements}_{name}_{k}": v for k, v in trial.figures.items()}
        cases = [(n, case, runs if case.full else min(runs, FEW)) for n, case in CASES.items()]
        flights = run_cases(flown, cases, seed=seed, at_once=AT_ONCE, jobs=self.jobs, say=say)
        pooled_runs = {name: pooled(case_runs) for name, case_runs in flights.items()}
        figures |= {f"mls_{name}_{k}": v for name, f in pooled_runs.items() for k, v in f.items()}
        figures |= {f"mls_{axis}_deg": pooled_runs["corrected"][f"{axis}_deg"] for axis in AXES}
        figures["mls_fixed_float_deg"] = max(pooled_runs[n]["fixed_float_deg"] for n in COMPARED)
        programs = MlsAttitude(), ArrayPhases(), ArrayPhases(axis="z")
        for config, schedules in schedules_of(*programs).items():
            for name, schedule in zip(("mls", "phases64", "phases64_z"), schedules, strict=True):
                figures[f"{name}_interval_cycles_{config}"] = float(schedule.interval)
        targets = targets_of(
            "boresight.systems.mls", figures, spreads_of(flights, "mls_"), runs=runs
        )
        meanings = {name: case.meaning for name, case in CASES.items()}
        text = render(meanings, pooled_runs, flights, patterns, targets)
        return ExperimentResult(
            figures=figures, targets=targets, details=meanings, pages={"mls.html": text}
        )
