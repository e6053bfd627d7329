"""PX4's EKF2: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Callable

from boresight import Experiment, Result
from boresight.sim.experiments.seeds import run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.sim.levels.build import Build
from boresight.systems.ekf2.estimator import Ekf2 as Filter
from boresight.systems.ekf2.page import render
from boresight.systems.ekf2.runs import CASES, CONFIG, run

__all__ = ["Ekf2"]

AT_ONCE = 10  #: runs of one task.


class Ekf2(Experiment):
    """PX4's EKF2 in a small aeroplane: all measurements, without satellites, without others."""

    name = "ekf2"
    pages = ("ekf2.html",)
    runs = 10

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`."""
        cases = [(name, name, runs) for name in CASES]
        flown = run_cases(run, cases, seed=seed, at_once=AT_ONCE, jobs=self.jobs, say=say)
        figures = {
            f"ekf2_{name}_{key}": value
            for name, of_case in flown.items()
            for key, value in of_case.pooled().items()
        }
        schedule = Build(Filter(), config=CONFIG).core.schedule
        figures["ekf2_interval_cycles"] = float(schedule.interval)
        figures["ekf2_state_cycles"] = float(max(schedule.latencies))
        targets = targets_of("boresight.systems.ekf2", figures, spreads_of(flown, "ekf2_"))
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in CASES.items()},
            pages={"ekf2.html": render(flown, targets, seed, runs)},
        )
