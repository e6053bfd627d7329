"""The array's attitude over eight hours: the paper's tables beside ours, and what limits them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from boresight import Experiment, ExperimentResult
from boresight.model.errors import require
from boresight.sim.experiments import seeds
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.seeds import Runs, run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.array.cases import CASES, RATES
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.page import render
from boresight.systems.array.runs import run_array
from boresight.systems.array.words import WORDS, run_width


class Array(Experiment):
    """Attitude of a radar array that turns for eight hours, Wang Wenzhe et al. (2016).

    Parameters
    ----------
    hours : float
        How long it turns, 1 to 24.
    jobs : int, optional
        See `Experiment`.

    Raises
    ------
    InputError
        Other hours.
    """

    runs = 8
    pages = ("array.html",)

    def __init__(self, hours: float = 8.0, jobs: int | None = None) -> None:
        super().__init__(jobs)
        require(1.0 <= hours <= 24.0, "experiment array, hours", "1 to 24", hours)
        self.hours = hours

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        """See `Experiment`; cases that only illustrate have fewer runs."""
        cases = [
            (name, replace(case, hours=self.hours), min(runs, case.runs))
            for name, case in CASES.items()
        ]
        flown = run_cases(run_array, cases, seed=seed, at_once=1, jobs=self.jobs, say=say)
        widths = [
            (f"{key}_{word}", (word, deg_s, self.hours), 1)
            for word in WORDS
            for key, deg_s in RATES.items()
        ]
        words = run_cases(run_width, widths, seed=seed, at_once=1, jobs=self.jobs, say=say)
        figures = figures_of(flown, words)
        for config, (schedule,) in schedules_of(ArrayAttitude()).items():
            figures[f"array_interval_cycles_{config}"] = float(schedule.interval)
            figures[f"array_attitude_latency_cycles_{config}"] = float(schedule.latency)
        targets = targets_of(
            "boresight.systems.array",
            figures,
            spreads_of(flown, "array_"),
            runs=runs,
            hours=self.hours,
        )
        hourly = {
            name: [result.hourly.tolist() for result in group.each] for name, group in flown.items()
        }
        return ExperimentResult(
            figures=figures,
            targets=targets,
            details={"cases": {n: c.meaning for n, c in CASES.items()}, "hourly_arcsec": hourly},
            pages={"array.html": render(flown, words, targets)},
        )


def figures_of(flown: Mapping[str, Runs], words: Mapping[str, Runs]) -> dict[str, float]:
    """Every number, by name."""
    figures = seeds.figures_of(flown, "array_") | seeds.figures_of(words, "array_words_")

    def values(end: str) -> list[float]:
        return [figures[f"array_{name}_{end}"] for name in flown]

    figures["array_fixed_float_arcsec_rms"] = max(values("fixed_float_rms"))
    figures["array_fixed_float_arcsec_max"] = max(values("fixed_float_max"))
    figures["array_least_eigenvalue_lsb"] = min(values("eigenvalue_min"))
    figures["array_saturated"] = sum(values("saturated_sum"))
    for key, end in (("a", "_slow"), ("b", "")):
        without, aided = (figures[f"array_{key}_{n}_heading_rms"] for n in ("none", "index"))
        figures[f"array_index_gain{end}"] = without / aided
    return figures
