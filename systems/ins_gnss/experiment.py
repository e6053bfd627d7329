"""Inertial navigation with satellite fixes: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Callable

from boresight import Experiment, Result
from boresight.sim.experiments.seeds import run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.sim.levels.build import Build
from boresight.systems.ins_gnss.estimator import InsGnss as Filter
from boresight.systems.ins_gnss.page import render
from boresight.systems.ins_gnss.runs import CASES, CONFIG, run

__all__ = ["InsGnss"]

AT_ONCE = 20  #: runs of one task.


class InsGnss(Experiment):
    """Inertial navigation with satellite fixes: vehicle, drone, outages, lever arm, delays."""

    name = "ins_gnss"
    pages = ("ins_gnss.html",)
    runs = 20

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`."""
        cases = [(name, name, runs) for name in CASES]
        flown = run_cases(run, cases, seed=seed, at_once=AT_ONCE, jobs=self.jobs, say=say)
        figures = {
            f"ins_gnss_{name}_{key}": value
            for name, of_case in flown.items()
            for key, value in of_case.pooled().items()
        }
        schedule = Build(Filter(), config=CONFIG).core.schedule
        figures["ins_gnss_interval_cycles"] = float(schedule.interval)
        figures["ins_gnss_state_cycles"] = float(max(schedule.latencies))
        targets = targets_of("boresight.systems.ins_gnss", figures, spreads_of(flown, "ins_gnss_"))
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in CASES.items()},
            pages={"ins_gnss.html": render(flown, targets, seed, runs)},
        )
