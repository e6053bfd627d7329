"""Cases run with many seeds, dealt out to processes; figures of each run, and of all."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.campaign import dispatch, duration

Case = TypeVar("Case")


def _root_mean_square(values: FloatArray) -> Any:
    return np.sqrt(np.mean(values**2))


#: How the figures of all runs become one, by the first end that their name has; else the mean.
POOLED: dict[str, Callable[[FloatArray], Any]] = {
    "rms": _root_mean_square,
    "max": np.max,
    "max_deg": np.max,
    "fixed_float_deg": np.max,
    "deg": _root_mean_square,
    "sigma": _root_mean_square,
    "min": np.min,
    "sum": np.sum,
    "saturated": np.sum,
    "median": np.median,
}


@dataclass(frozen=True, eq=False)
class Runs:
    """Results of the runs of one case."""

    figures: dict[str, FloatArray]  #: (runs,) by name.
    shown: Mapping[Any, Any] = field(default_factory=dict)  #: of the first run, for plots.
    each: list[Any] = field(default_factory=list)  #: further results of every run.

    def pooled(self) -> dict[str, float]:
        """One figure of all runs by name: root mean square, most, median and so on (`POOLED`)."""
        return {
            name: float(next((POOLED[e] for e in POOLED if name.endswith(e)), np.mean)(values))
            for name, values in self.figures.items()
        }


def figures_of(cases: Mapping[str, Runs], prefix: str = "") -> dict[str, float]:
    """Figures of all runs (`Runs.pooled`), by ``CASE_FIGURE``."""
    return {
        f"{prefix}{case}_{name}": value
        for case, runs in cases.items()
        for name, value in runs.pooled().items()
    }


def spreads_of(cases: Mapping[str, Runs], prefix: str = "") -> dict[str, tuple[float, float]]:
    """Least and greatest of the runs, by ``CASE_FIGURE``."""
    return {
        f"{prefix}{case}_{name}": (float(values.min()), float(values.max()))
        for case, runs in cases.items()
        for name, values in runs.figures.items()
    }


def run_cases(
    run: Callable[[Case, range], Runs],
    cases: Sequence[tuple[str, Case, int]],
    *,
    seed: int,
    at_once: int,
    jobs: int | None,
    say: Callable[[str], None],
) -> dict[str, Runs]:
    """Run every case (name, case, runs), ``at_once`` runs in a task.

    Tasks, and so the figures, do not depend on ``jobs``, the number of processes: by default one
    for each processor. The longest cases had better come first. See `dispatch`.
    """
    tasks = []
    for name, case, runs in cases:
        for first in range(seed, seed + runs, at_once):
            seeds = range(first, min(first + at_once, seed + runs))
            tasks.append(((name, first), run, (case, seeds)))
    parts: dict[str, dict[int, Runs]] = {name: {} for name, _, _ in cases}
    say(f"{len(cases)} cases, {sum(runs for _, _, runs in cases)} runs in {len(tasks)} tasks")
    start = time.monotonic()
    for completed, ((name, first), part) in enumerate(dispatch(jobs, tasks), 1):
        parts[name][first] = part
        so_far = duration(time.monotonic() - start)
        say(f"{completed} of {len(tasks)} after {so_far}: {name}, from seed {first} on")
    return {name: _joined([part for _, part in sorted(of.items())]) for name, of in parts.items()}


def _joined(parts: Sequence[Runs]) -> Runs:
    names = parts[0].figures
    figures = {name: np.concatenate([part.figures[name] for part in parts]) for name in names}
    return Runs(figures, parts[0].shown, [result for part in parts for result in part.each])
