"""The page of the satcom experiment: targets, cases, and the drive of one vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from boresight import Target
from boresight.sim.experiments.page import render as page
from boresight.sim.experiments.seeds import Runs
from boresight.sim.pages import Section
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.systems.satcom.cases import CASES, WHAT_IF, Case
from boresight.systems.satcom.innovations import plot_innovations
from boresight.systems.satcom.runs import ANGLES

_INTRO = (
    "Patent CN104880189 (2015) prints no figure: each of its claims is tested, and equations that "
    "it misprints are also simulated as printed. Five minutes of driving, the integer program of "
    "the core in closed loop with a 0.6 m antenna in Ku band; gyro bias (0.3, -0.4, 0.5) deg/s.",
    "{runs} runs, seeds {seed} to {last}; figures after half a minute: root mean square over all "
    "runs, the largest, or the mean. The prototype, in float, had ideal tracking errors of 0.2 "
    "deg.",
)
_CONSISTENCY = (
    "Innovations over the root of their variance: mean square of each run (left), autocorrelation "
    "(right); dotted: the bands of a consistent filter. Where R is the variance of the noise, and "
    "each tracking sample is a heading of its own, they are white with variance one, except for "
    "accelerations below the thresholds. By default R is larger, to cover those, and the heading "
    "of the PI loop is smooth: the filter is conservative, its variances are upper bounds."
)
_WHAT_IF = "Nothing is tuned: the filter's defaults, with other worlds. At most 25 runs each."
_COLUMNS = {
    **{f"{a}, deg": f"{a}_rms" for a in ANGLES},
    **{"PI loop, deg": "loop_rms", "bias, worst, deg/s": "bias_error_max"},
    **{"hits": "hit_rate", "false alarms": "false_rate", "loss 99 %, dB": "loss_db_99_max"},
    **{"fixed less float, most, deg": "fixed_float_max", "other decisions": "status_differs_sum"},
}
_SHOWN = ("adaptive", "fixed_r", "no_tracking", "city")


def render(flown: Mapping[str, Runs], targets: Sequence[Target], seed: int, runs: int) -> str:
    """HTML text: no script, nothing outside."""
    return page(
        "satcom",
        [text.format(runs=runs, seed=seed, last=seed + runs - 1) for text in _INTRO],
        targets,
        [
            Section(title="Cases", columns=("", *_COLUMNS), rows=_rows(CASES, flown)),
            Section(
                title="What if", text=_WHAT_IF, columns=("", *_COLUMNS), rows=_rows(WHAT_IF, flown)
            ),
            Section(
                title="Consistency of Q and R",
                text=_CONSISTENCY,
                figures=[
                    (CASES[n].meaning, plot_innovations(flown[n].each, ANGLES, n))
                    for n in ("declared", "adaptive")
                ],
            ),
            Section(
                title="First run",
                text="Error of roll, pitch and heading, error of the gyro bias, loss of the beam.",
                figures=[(CASES[n].meaning, _history(flown[n], CASES[n], n)) for n in _SHOWN],
            ),
        ],
    )


def _rows(cases: Mapping[str, Case], flown: Mapping[str, Runs]) -> list[list[str | float]]:
    figures = {name: flown[name].pooled() for name in cases}
    return [
        [case.meaning, *(figures[name][key] for key in _COLUMNS.values())]
        for name, case in cases.items()
    ]


def _history(result: Runs, case: Case, name: str) -> str:
    """Errors [deg, deg/s] and loss [dB] over time."""
    error, off, loss = (result.shown[n] for n in ("error", "off", "loss"))
    step = max(1, len(loss) // 3000)
    t = np.arange(len(loss))[::step] / case.rate_hz
    with settings():
        figure, (upper, middle, lower) = figure_and_axes(4.6, 3, sharex=True)
        for k, axis in enumerate(ANGLES):
            upper.plot(t, error[::step, k], color=COLOUR[axis], label=axis, linewidth=0.8)
            middle.plot(t, off[::step, k], color=COLOUR[axis], linewidth=0.8)
        lower.plot(t, loss[::step], color=COLOUR["grey"])
        for axes, label, limit in (
            (upper, "error, deg", 0.5),
            (middle, "bias, deg/s", 0.2),
            (lower, "loss, dB", 0.5),
        ):
            axes.set_ylabel(label)
            if np.abs(error[50:]).max() < 3.0:
                axes.set_ylim(0.0 if axes is lower else -limit, limit)
        lower.set_xlabel("time, s")
        legend(upper, 3)
        return svg(figure, name)
