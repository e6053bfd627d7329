"""The cell: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Callable

from boresight import Experiment, Result
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.seeds import run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.battery.estimator import Battery as Filter
from boresight.systems.battery.page import render
from boresight.systems.battery.runs import CASES, run

__all__ = ["Battery"]

AT_ONCE = 25  #: runs of one task.


class Battery(Experiment):
    """State of charge of a lithium cell: loads, rest, charge; cells and sensors that are off."""

    pages = ("battery.html",)
    runs = 25

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`."""
        cases = [(name, name, runs) for name in CASES]
        drained = run_cases(run, cases, seed=seed, at_once=AT_ONCE, jobs=self.jobs, say=say)
        figures = {
            f"battery_{name}_{key}": value
            for name, of_case in drained.items()
            for key, value in of_case.pooled().items()
        }
        for config, (schedule,) in schedules_of(Filter()).items():
            figures[f"battery_charge_cycles_{config}"] = float(schedule.latencies[0])
            figures[f"battery_interval_cycles_{config}"] = float(schedule.interval)
        targets = targets_of("boresight.systems.battery", figures, spreads_of(drained, "battery_"))
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in CASES.items()},
            pages={"battery.html": render(drained, targets, seed, runs)},
        )
