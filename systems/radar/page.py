"""The page of the radar experiment: targets, the paper's figures in both readings, the bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight import Target
from boresight.sim.experiments.page import render as page
from boresight.sim.pages import Section
from boresight.sim.plotting import COLOUR, figure_and_axes, settings, svg
from boresight.systems.radar.interface import AXES, BIASES
from boresight.systems.radar.runs import Predicted, Watched
from boresight.systems.radar.world import TwoRadars

_KINDS = ("range", "elevation", "azimuth")
_RADARS = (COLOUR["heading"], COLOUR["pitch"])

_INTRO = (
    "Two radars, registered by their tracks. Cui, Zhang, Wang (2014): biases of 20 m, 0.1 deg, "
    "0.2 deg and noise of 10 m, 0.07 deg, 0.15 deg of both radars, one missile. The paper claims "
    "99 % of the angles and 97 % of the ranges after 80 s. It does not say which P0 it used, nor "
    "whether its tracks were noisy. Without noise these figures come out; with the printed noise "
    "no unbiased estimator can reach them: at 80 s the bound of an angle is up to "
    "{elevation:.3g} % of the bias where the paper has 1 %. The information has a condition of "
    "{condition:.2g} at 170 s."
)
_RUNS = (
    "The runs have the printed noise and biases and a P0 of 50 m and 0.5 deg about zero, which "
    "draws the estimates towards zero: theory says by how much, and how far they then spread. A "
    "bound of equal biases holds where both radars are known to err alike: three unknowns in place "
    "of six. Normalised innovations squared: {mean:.4g} per degree of freedom, 95 % of "
    "{band[0]:.4g} to {band[1]:.4g}."
)
_COLUMNS = {
    **{"noise-free": "percent", "noise-free, 170 s": "170s_percent"},
    **{"bound, printed noise": "bound_percent", "bound, 170 s": "bound_170s_percent"},
    "bound, equal biases": "equal_percent",
}
_BIASES = (
    "Figures 2 to 4: errors of the biases in percent of the bias. Left without noise, on the right "
    "with the printed noise; grey what no unbiased estimator can beat with that noise and no "
    "prior, dashed the spread of the filter with its prior."
)
_FREE = (
    "Figures 5 to 10 without noise: reported less true position, corrected from 80 s on. At 80 s "
    "the printed biases make errors of {} m (radar 1: x, y, z) and {} m (radar 2). The paper "
    "states 260, 145, 170 m and 265, 125, 230 m, which do not follow from its biases."
)
_NOISY = (
    "Figures 5 to 10 with the printed noise, which is in both curves: the run with the median "
    "error of the first nine, or of all where there are fewer."
)


def render(
    noiseless: Watched,
    noisy: Watched,
    theory: Predicted,
    spread: Mapping[str, Any],
    metrics: Mapping[str, float],
    targets: Sequence[Target],
) -> str:
    """HTML text: no script, nothing outside."""
    share = 100.0 / np.abs(TwoRadars(noise=0.0, seconds=1.0).bias)
    at = int(np.searchsorted(noiseless.t, 80.0))
    reported = [", ".join(f"{abs(x):.0f}" for x in row) for row in noiseless.before[at]]
    with settings():
        plots = [
            (_BIASES, _biases(noiseless, noisy, theory, share)),
            (_FREE.format(*reported), _tracks(noiseless, "free")),
            (_NOISY, _tracks(noisy, "noisy")),
        ]
    rows: list[list[str | float]] = []
    for k, b in enumerate(BIASES):
        bias = spread["outputs"][f"{b}_bias"]
        sd, mean, band = (bias[key][-1] * share[k] for key in ("sd", "mean", "mean_band"))
        row = [metrics[f"registration_{b}_{key}"] for key in _COLUMNS.values()]
        row += [sd, theory.sd[800, k] * share[k], mean, theory.mean[800, k] * share[k], band]
        rows.append([b.replace("_", " radar "), *map(float, row)])
    runs = f"spread of {spread['runs']} runs"
    columns = ("bias", *_COLUMNS, runs, "theory", "mean error", "theory", "\N{PLUS-MINUS SIGN}")
    intro = _INTRO.format(
        elevation=metrics["registration_elevation_1_bound_percent"],
        condition=metrics["registration_condition"],
    )
    title = "At 80 s, in percent of the bias"
    return page(
        "radar",
        [intro],
        targets,
        [
            Section(title=title, text=_RUNS.format(**spread["nis"]), columns=columns, rows=rows),
            Section(title="Figures", figures=plots),
        ],
    )


def _biases(noiseless: Watched, noisy: Watched, theory: Predicted, share: Any) -> str:
    """Errors of the biases over time, and the bounds."""
    figure, axes = figure_and_axes(7.2, 3, 2, sharex=True)
    limits = ((20.0, 2000.0), (2.0, 400.0), (2.0, 100.0))
    for row, (kind, tops) in enumerate(zip(_KINDS, limits, strict=True)):
        for column, (run, top) in enumerate(zip((noiseless, noisy), tops, strict=True)):
            plot = axes[row, column]
            for radar, colour in enumerate(_RADARS):
                k = 3 * radar + row
                name = f"radar {radar + 1}"
                plot.plot(run.t, 100.0 * run.error[:, k], color=colour, label=name)
                if column:
                    label = f"spread, radar {radar + 1}"
                    plot.plot(run.t, share[k] * theory.sd[:, k], "--", color=colour, label=label)
                plot.plot(run.t, share[k] * theory.free[:, k], color=COLOUR["grey"], alpha=0.7)
            plot.axvline(80.0, color="#bbbbbb", linewidth=0.7)
            plot.set_ylim(-top, top)
        axes[row, 0].set_ylabel(f"{kind}, %")
    for column in range(2):
        axes[2, column].set_xlabel("time, s")
    _legend(figure, axes[0, 1])
    return svg(figure, "biases")


def _legend(figure: Any, axes: Any) -> None:
    """Legend of one plot over all."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=len(labels))


def _tracks(run: Watched, salt: str) -> str:
    """Errors of the tracks before and after, by radar and axis."""
    figure, axes = figure_and_axes(5.0, 2, 3, sharex=True)
    for i in range(2):
        for k, axis in enumerate(AXES):
            plot = axes[i, k]
            plot.plot(run.t, run.before[:, i, k], color=COLOUR["grey"], label="reported")
            plot.plot(run.t, run.after[:, i, k], color=_RADARS[i], label="corrected")
            plot.set_title(f"radar {i + 1}, {axis}", fontsize=9, loc="right")
        axes[i, 0].set_ylabel("error, m")
    for plot in axes[1]:
        plot.set_xlabel("time, s")
    _legend(figure, axes[0, 0])
    return svg(figure, f"tracks-{salt}")
