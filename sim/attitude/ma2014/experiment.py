"""The experiment of Ma Long et al. (2014) in simulation: its tables, its figures, its page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.sim.attitude.ma2014 import paper
from boresight.sim.attitude.ma2014.errors import entries_in_band
from boresight.sim.attitude.ma2014.methods import METHODS, count_mismatches
from boresight.sim.attitude.ma2014.sections import (
    HEADING_RUNS,
    JUDGED,
    SIDE_RUNS,
    differences,
    heading_test,
    kinematics,
    stacked,
    timing,
)
from boresight.sim.attitude.ma2014.targets import targets
from boresight.sim.attitude.ma2014.world import CASES, E2, make_log
from boresight.sim.experiments.experiment import Experiment, ExperimentResult, Target
from boresight.sim.experiments.page import render
from boresight.sim.pages import Section
from boresight.sim.records.record import Record

__all__ = ["Ma2014", "measure"]

Say = Callable[[str], None]

_INTRO = (
    "Ma Long, Zhang Rui, Su Zhigang (2014): magnetometer-aided attitude of MEMS sensors. Its two "
    "tests are repeated in simulation with the sensors of its Table 2: a heading that swings, and "
    "the stage of Table 1. Its filters run as the integer C of the core.",
    "{runs} runs, seeds {seed} to {last}: boresight experiment ma2014 --seed {seed}. Standard "
    "deviations are pooled over the runs.",
)
#: Rows of Table 2.
_TABLE_2 = {
    "gyro_bias": "gyro bias, rad/s",
    "gyro": "gyro, (rad/s)\N{SUPERSCRIPT TWO}",
    "accelerometer": "accelerometer, (m/s\N{SUPERSCRIPT TWO})\N{SUPERSCRIPT TWO}",
    "magnetometer_g": "magnetometer, G\N{SUPERSCRIPT TWO}",
}


class Ma2014(Experiment):
    """Magnetometer-aided MEMS attitude: Ma Long, Zhang Rui, Su Zhigang (2014)."""

    pages = ("ma2014.html",)

    def run(self, *, seed: int, runs: int, say: Say) -> ExperimentResult:
        """See `Experiment`: of the paper's targets only Figure 7 is binding, at equal gains."""
        details = measure(seed, runs, say, self.jobs)
        first = make_log(E2, CASES["C"], details["seed"])
        judged_targets = (*targets(details), *_equalities(first, say))
        return ExperimentResult(
            figures=_figures(details),
            targets=judged_targets,
            details=details,
            pages={"ma2014.html": _page(details, judged_targets)},
        )


def measure(seed: int, runs: int, say: Say, jobs: int | None = None) -> dict[str, Any]:
    """All that the page shows, as plain data; see `docs/systems/ma2014.md`."""
    seeds = [seed + k for k in range(runs)]
    rows, errors = stacked(seeds, say, jobs)
    return {
        "seed": seed,
        "runs": runs,
        "side_runs": min(runs, SIDE_RUNS),
        "table_3": {
            "cases": rows,
            "in_band": {case: entries_in_band(rows[case]) for case in JUDGED},
        },
        "parameters": {method.key: method.params for method in METHODS},
        "spectra": heading_test(seeds[:HEADING_RUNS], say),
        "difference": differences(errors),
        "kinematics": kinematics(say),
        "timing": timing(say),
    }


def _equalities(log: Record, say: Say) -> list[Target]:
    """Binding targets: C equals the integer interpreter."""
    out = []
    for method in METHODS:
        if method.key != method.estimator.name:
            continue  # the same estimator with other parameters
        say(f"C against the integer interpreter: {method.key}")
        mismatches, total = count_mismatches(method, log)
        out.append(
            Target(
                name=f"{method.key}: updates in which C and the integer interpreter differ",
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
            pooled = row["fixed"]["sd"]["pooled"]
            for axis, value in zip(paper.AXES, pooled, strict=True):
                out[f"{key}: sd, {case}, {axis}, deg"] = value
    for key, method in details["spectra"]["methods"].items():
        out[f"{key}: heading line at 1/6 Hz, deg"] = method["line_deg"]["median"]
    for row in details["timing"]:
        out[f"{row['estimator']} on {row['config']}: cycles"] = row["cycles"]
        out[f"{row['estimator']} on {row['config']}: us"] = row["us"]
    return out


def _page(details: Mapping[str, Any], judged: Sequence[Target]) -> str:
    """HTML text: the targets, Tables 2 and 3, the times, and what the paper leaves open."""
    runs, seed = details["runs"], details["seed"]
    methods = [
        (row["title"], *(value for case in JUDGED for value in _pooled(details, case, key)))
        for key, row in details["table_3"]["cases"]["C"].items()
    ]
    columns = ("", *(f"{axis}, {case}, deg" for case in JUDGED for axis in paper.AXES))
    times = [
        (f"{row['estimator']}, {row['config']}", row["cycles"], row["us"], row["paper_us"])
        for row in details["timing"]
    ]
    return render(
        "ma2014",
        [text.format(runs=runs, seed=seed, last=seed + runs - 1) for text in _INTRO],
        judged,
        [
            Section(
                title="Table 2: bias and variances of the sensors, as printed",
                columns=("", "x", "y", "z"),
                rows=[
                    (name, *(f"{v:.5g}" for v in getattr(paper.TABLE_2, key)))
                    for key, name in _TABLE_2.items()
                ],
            ),
            Section(title="Table 3: standard deviations", columns=columns, rows=methods),
            Section(
                title="Figure 8: time of one update at 100 MHz",
                columns=("", "cycles", "core, us", "paper, us"),
                rows=times,
            ),
            Section(
                title="What the paper leaves open, or prints twice",
                columns=("", "assumed here"),
                rows=paper.OPEN,
            ),
        ],
    )


def _pooled(details: Mapping[str, Any], case: str, key: str) -> Any:
    return details["table_3"]["cases"][case][key]["fixed"]["sd"]["pooled"]
