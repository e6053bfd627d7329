"""The experiment of Ma Long et al. (2014) in simulation: its tables, its figures, its page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from boresight.sim.attitude.ma2014 import paper
from boresight.sim.attitude.ma2014.errors import entries_in_band
from boresight.sim.attitude.ma2014.methods import (
    METHODS,
    count_mismatches,
    gains_per_s,
    kalman_parameters,
    truth_deg,
)
from boresight.sim.attitude.ma2014.page import render
from boresight.sim.attitude.ma2014.sections import (
    HEADING_RUNS,
    JUDGED,
    KALMAN,
    SIDE_RUNS,
    calibration,
    differences,
    heading_test,
    kinematics,
    plain,
    stacked,
    table_1,
    timing,
)
from boresight.sim.attitude.ma2014.targets import targets
from boresight.sim.attitude.ma2014.world import CASES, E2, LEAD, make_log
from boresight.sim.experiments.experiment import Experiment, Result, Target
from boresight.sim.records.record import Record

__all__ = ["Ma2014", "measure"]

Say = Callable[[str], None]

_SHOWN = ("complementary", "complementary_as_printed", *KALMAN)


class Ma2014(Experiment):
    """Magnetometer-aided MEMS attitude: Ma Long, Zhang Rui, Su Zhigang (2014).

    The curves show the run in the middle: the one whose complementary heading error has the median
    standard deviation in case C.
    """

    pages = ("ma2014.html",)

    def run(self, *, seed: int, runs: int, say: Say) -> Result:
        """See `Experiment`: the targets of the paper are reported, those of ours are binding."""
        details = measure(seed, runs, say, self.jobs)
        first = make_log(E2, CASES["C"], details["shown_seed"])
        judged_targets = (*targets(details), *_equalities(first, say))
        return Result(
            figures=_figures(details),
            targets=judged_targets,
            details=details,
            pages={"ma2014.html": render(details, judged_targets)},
        )


def measure(seed: int, runs: int, say: Say, jobs: int | None = None) -> dict[str, Any]:
    """All that the page shows, as plain data; see `docs/systems/ma2014.md`."""
    seeds = [seed + k for k in range(runs)]
    rows, errors = stacked(seeds, say, jobs)
    heading = errors["C/complementary"][:, :, 2].std(axis=0)
    median_run = int(np.argsort(heading)[(runs - 1) // 2])  # the run in the middle
    first = make_log(E2, CASES["C"], seeds[median_run])
    other_seeds = [s for s in seeds if s != seeds[median_run]][: HEADING_RUNS - 1]
    t = first.values("t", "s")[LEAD:]
    return {
        "seed": seed,
        "runs": runs,
        "shown_seed": seeds[median_run],
        "side_runs": min(runs, SIDE_RUNS),
        "table_1": table_1(first),
        "table_3": {
            "cases": rows,
            "in_band": {case: entries_in_band(rows[case]) for case in JUDGED},
        },
        "parameters": {
            "complementary": gains_per_s(),
            **{key: kalman_parameters(key) for key in KALMAN},
        },
        "spectra": heading_test([seeds[median_run], *other_seeds], say),
        "figures": {
            "time_s": plain(t, 3),
            "stages_deg": plain(np.degrees(E2.stages(t)[0]), 3),
            "truth_deg": plain(truth_deg(first)[LEAD:], 3),
            "error_deg": {key: plain(errors[f"C/{key}"][:, median_run], 4) for key in _SHOWN},
        },
        "difference": differences(errors),
        "kinematics": kinematics(say),
        "calibration": calibration(seed),
        "timing": timing(say),
    }


def _equalities(log: Record, say: Say) -> list[Target]:
    """Binding targets: C equals the integer interpreter."""
    out = []
    for method in METHODS:
        if method.estimator is None or method.key.startswith("gyro"):
            continue
        say(f"C against the integer interpreter: {method.estimator}")
        mismatches, total = count_mismatches(method, log)
        out.append(
            Target(
                name=f"{method.estimator}: updates in which C and the integer interpreter differ",
                source="bit for bit",
                value=mismatches if total else np.nan,
                high=0,
                note=f"{total:,} updates compared.",
            )
        )
    return out


def _figures(details: Mapping[str, Any]) -> dict[str, float]:
    """Table 3, the lines of the spectra and the times, by name."""
    out = {}
    for case in JUDGED:
        for key, row in details["table_3"]["cases"][case].items():
            pooled = (row["fixed"] or row["float"])["sd"]["pooled"]
            for axis, value in zip(paper.AXES, pooled, strict=True):
                out[f"{key}: sd, {case}, {axis}, deg"] = value
    for key, method in details["spectra"]["methods"].items():
        out[f"{key}: heading line at 1/6 Hz, deg"] = method["line_deg"]["median"]
    for row in details["timing"]:
        out[f"{row['estimator']} on {row['config']}: cycles"] = row["cycles"]
        out[f"{row['estimator']} on {row['config']}: us"] = row["us"]
    return out
