"""The page of the satcom experiment: targets, cases, and what one vehicle did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from boresight.sim.experiments.experiment import Target
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.sim.worlds.satcom_drive import RATE_HZ

__all__ = ["render"]

_SHOWN = ("adaptive", "fixed_r", "no_tracking", "city")


def render(
    cases: Mapping[str, Any],
    found: Mapping[str, Mapping[str, float]],
    shown: Mapping[str, Any],
    targets: Sequence[Target],
) -> str:
    """HTML text: no script, nothing outside."""
    import jinja2

    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    page = files("boresight.sim.experiments.satcom").joinpath("page.html")
    return environment.from_string(page.read_text(encoding="utf-8")).render(
        cases=cases,
        found=found,
        targets=targets,
        plots={
            name: _plot(shown[name][0], shown[name][1], name) for name in _SHOWN if name in shown
        },
    )


def _plot(error: Any, loss: Any, name: str) -> str:
    """Errors [deg] and loss [dB] over time."""
    step = max(1, len(loss) // 3000)
    t = np.arange(len(loss))[::step] / RATE_HZ
    with settings():
        figure, (upper, lower) = figure_and_axes(3.6, 2, sharex=True)
        for k, axis in enumerate(("roll", "pitch", "heading")):
            upper.plot(t, error[::step, k], color=COLOUR[axis], label=axis, linewidth=0.8)
        lower.plot(t, loss[::step], color=COLOUR["grey"])
        upper.set_ylabel("error, deg")
        lower.set(xlabel="time, s", ylabel="loss, dB")
        if np.abs(error).max() < 3.0:
            upper.set_ylim(-1.0, 1.0)
            lower.set_ylim(0.0, 1.0)
        legend(upper, 3)
        return svg(figure, name)
