"""The satcom tracker: what the patent claims, with the figures that it does not print."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from importlib.resources import files

from boresight.gateware.core import build_core
from boresight.gateware.machine import CONFIGS
from boresight.model.estimators.satcom import Satcom as Filter
from boresight.sim.experiments.experiment import Experiment, Result, Target
from boresight.sim.experiments.satcom.cases import CASES, WHAT_IF
from boresight.sim.experiments.satcom.flight import ANGLES, fly
from boresight.sim.experiments.satcom.page import render
from boresight.sim.experiments.seeds import Runs, run_cases

__all__ = ["Satcom", "targets_of"]

AT_ONCE = 50  #: runs of one task.
FEW = 25  #: most runs of a case of `WHAT_IF`.

#: Figures that are asked for by name: of which case, which.
_NAMED = {
    **{f"{axis}_deg": f"adaptive_{axis}_rms" for axis in ANGLES},
    **{"fixed_r_deg": "fixed_r_worst_rms", "bias_error_deg_s": "adaptive_bias_error_max"},
    **{"fixed_float_deg": "adaptive_fixed_float_max", "loop_deg": "pi_alone_loop_rms"},
    **{"fixed_float_rms_deg": "adaptive_fixed_float_rms", "hit_rate": "adaptive_hit_rate"},
    **{"pointing_loss_db": "adaptive_loss_db_99_max", "false_rate": "adaptive_false_rate"},
}


class Satcom(Experiment):
    """Satcom on the move: adaptive R and heading from tracking, patent CN104880189 (2015).

    ``jobs``: processes; by default one for each processor. Figures do not depend on it.
    """

    pages = ("satcom.html",)

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = jobs

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> Result:
        """See `Experiment`; cases of `WHAT_IF` have at most `FEW` runs."""
        cases = [(name, case, runs) for name, case in CASES.items()]
        cases += [(name, case, min(runs, FEW)) for name, case in WHAT_IF.items()]
        cases.sort(key=lambda one: one[0] != "city")  # the longest first
        flown = run_cases(fly, cases, seed=seed, at_once=AT_ONCE, jobs=self.jobs, say=say)
        figures = {
            f"satcom_{name}_{key}": value
            for name, of_case in flown.items()
            for key, value in of_case.pooled().items()
        }
        figures |= {f"satcom_{name}": figures[f"satcom_{key}"] for name, key in _NAMED.items()}
        for config in CONFIGS:
            schedule = build_core(Filter().compile(), config).schedule
            figures[f"satcom_interval_cycles_{config}"] = float(schedule.interval)
        targets = targets_of(flown)
        return Result(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in (CASES | WHAT_IF).items()},
            pages={"satcom.html": render(flown, targets, seed, runs)},
        )


def targets_of(flown: Mapping[str, Runs]) -> tuple[Target, ...]:
    """The rows of ``targets.csv``: every claim, and what the prototype found."""
    table = files("boresight.sim.experiments.satcom").joinpath("targets.csv")
    return tuple(
        Target(
            name=row["name"],
            source=row["source"],
            value=flown[row["case"]].pooled()[row["figure"]],
            low=float(row["low"]) if row["low"] else None,
            high=float(row["high"]) if row["high"] else None,
            unit=row["unit"],
            beside={"prototype": float(row["prototype"])} if row["prototype"] else {},
            spread=(float(of_runs.min()), float(of_runs.max())),
        )
        for row in csv.DictReader(table.read_text(encoding="utf-8").splitlines())
        for of_runs in (flown[row["case"]].figures[row["figure"]],)
    )
