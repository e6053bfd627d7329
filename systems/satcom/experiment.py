"""The satcom tracker: the patent's claims, with the figures that it does not print."""

from __future__ import annotations

from collections.abc import Callable

from boresight import Experiment, ExperimentResult
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.seeds import figures_of, run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of
from boresight.systems.satcom.cases import CASES, WHAT_IF, Case
from boresight.systems.satcom.drive import drive
from boresight.systems.satcom.estimator import Satcom as Filter
from boresight.systems.satcom.page import render
from boresight.systems.satcom.runs import ANGLES, fly

UPDATES = 4_500_000  #: most updates of one task, by memory.
FEW = 25  #: most runs of a case of `WHAT_IF`.

#: Figures with names of their own: by case and figure.
_NAMED = {
    **{f"{axis}_deg": f"adaptive_{axis}_rms" for axis in ANGLES},
    **{"fixed_r_deg": "fixed_r_worst_rms", "bias_error_deg_s": "adaptive_bias_error_max"},
    **{"fixed_float_deg": "adaptive_fixed_float_max", "loop_deg": "pi_alone_loop_rms"},
    **{"fixed_float_rms_deg": "adaptive_fixed_float_rms", "hit_rate": "adaptive_hit_rate"},
    **{"pointing_loss_db": "adaptive_loss_db_99_max", "false_rate": "adaptive_false_rate"},
}


class Satcom(Experiment):
    """Satcom on the move: adaptive R and heading from tracking, patent CN104880189 (2015)."""

    pages = ("satcom.html",)

    def run(self, *, seed: int, runs: int, say: Callable[[str], None]) -> ExperimentResult:
        """See `Experiment`; cases of `WHAT_IF` have at most `FEW` runs."""
        cases = [(name, case, runs) for name, case in CASES.items()]
        cases += [(name, case, min(runs, FEW)) for name, case in WHAT_IF.items()]
        cases.sort(key=lambda item: item[0] != "city")  # the longest first
        flown = run_cases(fly, cases, seed=seed, at_once=_at_once, jobs=self.jobs, say=say)
        figures = figures_of(flown, "satcom_")
        figures |= {f"satcom_{name}": figures[f"satcom_{key}"] for name, key in _NAMED.items()}
        for config, (schedule,) in schedules_of(Filter()).items():
            figures[f"satcom_interval_cycles_{config}"] = float(schedule.interval)
        targets = targets_of("boresight.systems.satcom", figures, spreads_of(flown, "satcom_"))
        return ExperimentResult(
            figures=figures,
            targets=targets,
            details={name: case.meaning for name, case in (CASES | WHAT_IF).items()},
            pages={"satcom.html": render(flown, targets, seed, runs)},
        )


def _at_once(case: Case) -> int:
    """Runs of a case side by side."""
    return max(1, UPDATES // len(drive(case.drive, case.rate_hz).ride.q))
