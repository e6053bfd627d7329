"""The page of the experiment: targets, cases, and what one run did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from boresight import Target
from boresight.sim.experiments.page import render_cases
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import error_history
from boresight.systems.ekf2.estimator import DT
from boresight.systems.ekf2.runs import CASES

__all__ = ["render"]

_INTRO = (
    "24 error states of PX4's EKF2: attitude, velocity, position, biases of gyro and "
    "accelerometer, earth's and body's magnetic field, wind, terrain; one scalar measurement in "
    "each of 100 updates a second.",
    "{runs} runs of the integer program, seeds {seed} to {last}, 90 s each; figures after half a "
    "minute, velocity and position without the outages and two seconds after them. Drift: most "
    "position error within an outage.",
)
_COLUMNS = {
    **{"attitude, rms, deg": "attitude_rms", "velocity, rms, m/s": "velocity_rms"},
    **{"position, rms, m": "position_rms", "wind, rms, m/s": "wind_rms"},
    **{"terrain, rms, m": "terrain_rms", "drift, most, m": "drift_max"},
    "fixed less float64, most, deg": "fixed_float_max",
}
_SHOWN = ("flight", "outage")
_AXES = {
    **{"attitude": ("attitude, deg", "roll"), "v": ("velocity, m/s", "pitch")},
    **{"p": ("position, m", "heading"), "wind": ("wind, m/s", "roll")},
}


def render(flown: Mapping[str, Runs], targets: Sequence[Target], seed: int, runs: int) -> str:
    """HTML text: no script, nothing outside."""
    return render_cases(
        "ekf2",
        _INTRO,
        targets,
        flown,
        seed=seed,
        runs=runs,
        meanings={name: case.meaning for name, case in CASES.items()},
        columns=_COLUMNS,
        text="Errors of attitude, velocity, position and wind.",
        plots={
            name: error_history(flown[name].shown, _AXES, step_s=DT, height=5.2, name=name)
            for name in _SHOWN
        },
    )
