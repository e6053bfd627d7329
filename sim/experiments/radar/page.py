"""The page of the radar experiment: targets, the paper's figures in both readings, the bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model.estimators.radar.interface import AXES, BIASES
from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.radar.runs import Predicted, Watched
from boresight.sim.pages import page
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.sim.worlds.radar.world import TwoRadars

__all__ = ["render"]

_KINDS = ("range", "elevation", "azimuth")
_RADARS = (COLOUR["heading"], COLOUR["pitch"])


def render(
    free: Watched,
    noisy: Watched,
    theory: Predicted,
    spread: Mapping[str, Any],
    found: Mapping[str, float],
    targets: Sequence[Target],
) -> str:
    """HTML text: no script, nothing outside."""
    share = 100.0 / np.abs(TwoRadars(noise=0.0, seconds=1.0).bias)
    with settings():
        plots = {
            "Figures 2 to 4: errors of the biases in percent of the bias. Left without noise, on "
            "the right with the printed noise; grey what no unbiased estimator can beat with that "
            "noise and no prior, dashed the spread of the filter with its prior.": _biases(
                free, noisy, theory, share
            ),
            "Figures 5 to 10 without noise: reported less true position, corrected from 80 s on.": (
                _tracks(free, "free")
            ),
            "Figures 5 to 10 with the printed noise, which is in both curves.": (
                _tracks(noisy, "noisy")
            ),
            "The direction that the tracks tell least of after 170 s, in units of the noise: both "
            "ranges together, which shifts both tracks alike.": _weak(theory),
        }
    rows = []
    for k, b in enumerate(BIASES):
        one = spread["outputs"][f"{b}_bias"]
        row = {key: one[key][-1] * share[k] for key in ("sd", "mean", "mean_band")}
        row |= {f"{key}_theory": getattr(theory, key)[800, k] * share[k] for key in ("sd", "mean")}
        rows.append((f"registration_{b}_", b.replace("_", " radar "), row))
    return page(
        "boresight.sim.experiments.radar",
        "page.html",
        rows=rows,
        targets=targets,
        plots=plots,
        found=found,
        runs=spread["runs"],
        nis=spread["nis"],
    )


def _biases(free: Watched, noisy: Watched, theory: Predicted, share: Any) -> str:
    """Errors of the biases over time, and the bounds."""
    figure, axes = figure_and_axes(7.2, 3, 2, sharex=True)
    limits = ((20.0, 2000.0), (2.0, 400.0), (2.0, 60.0))
    for row, (kind, tops) in enumerate(zip(_KINDS, limits, strict=True)):
        for column, (run, top) in enumerate(zip((free, noisy), tops, strict=True)):
            one = axes[row, column]
            for radar, colour in enumerate(_RADARS):
                k = 3 * radar + row
                name = f"radar {radar + 1}"
                one.plot(run.t, 100.0 * run.error[:, k], color=colour, label=name)
                if column:
                    label = f"spread, radar {radar + 1}"
                    one.plot(run.t, share[k] * theory.sd[:, k], "--", color=colour, label=label)
                one.plot(run.t, share[k] * theory.free[:, k], color=COLOUR["grey"], alpha=0.7)
            one.axvline(80.0, color="#bbbbbb", linewidth=0.7)
            one.set_ylim(-top, top)
        axes[row, 0].set_ylabel(f"{kind}, %")
    for column in range(2):
        axes[2, column].set_xlabel("time, s")
        legend(axes[0, column], 4)
    return svg(figure, "biases")


def _tracks(run: Watched, salt: str) -> str:
    """Errors of the tracks before and after, by radar and axis."""
    figure, axes = figure_and_axes(5.0, 2, 3, sharex=True)
    for i in range(2):
        for k, axis in enumerate(AXES):
            one = axes[i, k]
            one.plot(run.t, run.before[:, i, k], color=COLOUR["grey"], label="reported")
            one.plot(run.t, run.after[:, i, k], color=_RADARS[i], label="corrected")
            one.set_title(f"radar {i + 1}, {axis}", fontsize=9, loc="right")
        axes[i, 0].set_ylabel("error, m")
    for one in axes[1]:
        one.set_xlabel("time, s")
    legend(axes[0, 0], 2)
    return svg(figure, f"tracks-{salt}")


def _weak(theory: Predicted) -> str:
    """The least observed direction."""
    figure, one = figure_and_axes(2.4)
    names = [b.replace("_", " ") for b in BIASES]
    one.bar(names, theory.weak, color=[_RADARS[0]] * 3 + [_RADARS[1]] * 3)
    one.set_ylabel("share")
    return svg(figure, "weak")
