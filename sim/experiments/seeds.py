"""Cases run with many seeds, dealt out to processes; figures of each run, and of all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from boresight.sim.processes import dispatch

__all__ = ["Runs", "run_cases", "spreads_of"]

FloatArray = npt.NDArray[np.float64]
Case = TypeVar("Case")

#: How the figures of all runs become one, by the end of their name; else it is the mean.
POOLED: dict[str, Callable[[FloatArray], Any]] = {
    "rms": lambda values: np.sqrt(np.mean(values**2)),
    "max": np.max,
    "min": np.min,
    "sum": np.sum,
}


@dataclass(frozen=True, eq=False)
class Runs:
    """What the runs of one case gave.

    Attributes
    ----------
    figures : dict of str to float64 (runs,)
    shown : mapping
        What is shown of the first run.
    each : list
        Whatever else is kept of every run.
    pooling : mapping of str to str
        How figures become one, if the end of their name does not say so.
    """

    figures: dict[str, FloatArray]
    shown: Mapping[str, Any] = field(default_factory=dict)
    each: list[Any] = field(default_factory=list)
    pooling: Mapping[str, str] = field(default_factory=dict)

    def pooled(self) -> dict[str, float]:
        """One figure of all runs by name: root mean square, most, sum or mean (`POOLED`)."""
        return {
            name: float(
                POOLED.get(self.pooling.get(name, name.rpartition("_")[2]), np.mean)(values)
            )
            for name, values in self.figures.items()
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
    tasks = [
        ((name, first), run, (case, range(first, min(first + at_once, seed + runs))))
        for name, case, runs in cases
        for first in range(seed, seed + runs, at_once)
    ]
    parts: dict[tuple[str, int], Runs] = {}
    for label, part in dispatch(jobs, tasks):
        parts[label] = part
        say(f"{len(parts)} of {len(tasks)}: {label[0]}, from seed {label[1]} on")
    return {
        name: _joined([parts[name, first] for first in range(seed, seed + runs, at_once)])
        for name, _, runs in cases
    }


def _joined(parts: Sequence[Runs]) -> Runs:
    names = parts[0].figures
    figures = {name: np.concatenate([part.figures[name] for part in parts]) for name in names}
    each = [result for part in parts for result in part.each]
    return Runs(figures, parts[0].shown, each, parts[0].pooling)
