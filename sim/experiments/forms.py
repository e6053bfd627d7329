"""Forms of an estimator, as experiments compare them: runs of each form, cycles in hardware."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.slots import Schedule
from boresight.model.arrays import FloatArray
from boresight.model.estimator import Estimator
from boresight.sim.levels.build import Build, Run
from boresight.sim.levels.registry import make_level


def run_forms(
    estimator: Estimator,
    records: Iterable[FloatArray],
    *,
    params: Mapping[str, float] | None = None,
    levels: Sequence[str] = ("c", "float"),
) -> list[list[Run]]:
    """For each level its runs on each of the records, every run from a reset on.

    ``records`` are inputs (n, n_inputs) of each run, in their units; the levels are by default the
    integer C and float64.
    """
    build, rows = Build(estimator, params=[params]), list(map(np.ascontiguousarray, records))
    runs = []
    for name in levels:
        with make_level(name, build) as level:
            runs.append([level.run_anew(row) for row in rows])
    return runs


def schedules_of(*estimators: Estimator) -> dict[str, tuple[Schedule, ...]]:
    """Schedules of estimators that share a core, in their order, for "small" and "fast".

    ``interval`` of each is the cycles from one record to the next, ``latency`` those to the last of
    its urgent outputs. `ScheduleError`: they do not fit into one core.
    """
    return {
        config: tuple(part.schedule for part in Build(*estimators, config=config).core.parts)
        for config in CONFIGS
    }
