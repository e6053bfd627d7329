"""The sensorless drive: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Callable

from boresight import Experiment, Result
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.seeds import run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.pmsm.estimator import Pmsm as Core
from boresight.systems.pmsm.page import render
from boresight.systems.pmsm.runs import run
from boresight.systems.pmsm.world import MACHINES

__all__ = ["Pmsm"]

AT_ONCE = 25  #: runs of one task.


class Pmsm(Experiment):
    """Sensorless motor drive at 20 kHz: start, load steps, reversal, machines that are off."""

    pages = ("pmsm.html",)
    runs = 25

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`."""
        cases = [(name, name, runs) for name in MACHINES]
        driven = run_cases(run, cases, seed=seed, at_once=AT_ONCE, jobs=self.jobs, say=say)
        figures = {
            f"pmsm_{name}_{key}": value
            for name, of_case in driven.items()
            for key, value in of_case.pooled().items()
        }
        for config, (schedule,) in schedules_of(Core()).items():
            figures[f"pmsm_interval_cycles_{config}"] = float(schedule.interval)
            figures[f"pmsm_voltage_cycles_{config}"] = float(max(schedule.latencies[:2]))
        targets = targets_of("boresight.systems.pmsm", figures, spreads_of(driven, "pmsm_"))
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in MACHINES.items()},
            pages={"pmsm.html": render(driven, targets, seed, runs)},
        )
