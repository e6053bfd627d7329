"""The page of the drive's experiment: targets, cases, and what one machine did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from boresight import Target
from boresight.sim.experiments.page import render_cases
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.systems.pmsm.estimator import DT
from boresight.systems.pmsm.world import MACHINES

__all__ = ["render"]

_INTRO = (
    "One core has the currents of a machine and answers with the next voltage, 20,000 times a "
    "second: Kalman filter of four states, speed and current controllers, no sensor at the rotor. "
    "Forced start from any angle, load from 0.3 to 0.45 s, reversal at 0.5 s, load again.",
    "{runs} runs of the integer program in closed loop, seeds {seed} to {last}; angle and speed "
    "from 0.25 s on, in electrical degrees. Nothing is tuned for a case.",
)
_COLUMNS = {
    **{"angle, rms, deg": "angle_rms", "most, deg": "angle_max", "speed, rms, rad/s": "speed_rms"},
    **{"at the end of the start, most, deg": "start_max", "slower under load, rad/s": "dip_max"},
    **{"reversed within, s": "reversal_max", "fixed less float64, most, deg": "fixed_float_max"},
    "loops, fixed less float64, most, rad/s": "loops_max",
}
_SHOWN = ("known", "warm", "dead_time")


def render(driven: Mapping[str, Runs], targets: Sequence[Target], seed: int, runs: int) -> str:
    """HTML text: no script, nothing outside."""
    return render_cases(
        "pmsm",
        _INTRO,
        targets,
        driven,
        seed=seed,
        runs=runs,
        meanings={name: case.meaning for name, case in MACHINES.items()},
        columns=_COLUMNS,
        text="Speed, true and estimated, and error of the angle.",
        plots={name: _history(driven[name], name) for name in _SHOWN},
    )


def _history(runs: Runs, name: str) -> str:
    angle, speed = runs.shown["angle"][::8], runs.shown["speed"][::8]
    t = 8 * DT * np.arange(len(angle))
    with settings():
        figure, (upper, lower) = figure_and_axes(3.6, 2, sharex=True)
        for column, (label, colour) in enumerate((("estimated", "roll"), ("true", "grey"))):
            upper.plot(t, speed[:, column], color=COLOUR[colour], label=label, linewidth=0.8)
        lower.plot(t, angle, color=COLOUR["pitch"], linewidth=0.8)
        lower.set_ylim(-40.0, 40.0)
        upper.set_ylabel("speed, rad/s")
        lower.set_ylabel("angle, deg")
        lower.set_xlabel("time, s")
        legend(upper, 2)
        return svg(figure, name)
