"""The page of the experiment: targets, cases, and what one run did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from boresight import Target
from boresight.sim.experiments.page import render_cases
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import error_history
from boresight.systems.ins_gnss.estimator import DT
from boresight.systems.ins_gnss.runs import CASES

__all__ = ["render"]

_INTRO = (
    "15 error states: attitude, velocity, position, biases of gyro and accelerometer. Inertial "
    "sensors at 100 Hz, fixes of 1 m and 0.1 m/s at 10 Hz, 0.1 s late, of an antenna 1.5 m away.",
    "{runs} runs of the integer program, seeds {seed} to {last}, two minutes each; figures after "
    "half a minute, without the outages and two seconds after them. Drift: most position error "
    "within an outage.",
)
_COLUMNS = {
    **{"attitude, rms, deg": "attitude_rms", "most, deg": "attitude_max"},
    **{"velocity, rms, m/s": "velocity_rms", "position, rms, m": "position_rms"},
    **{"drift, most, m": "drift_max", "fixed less float64, most, deg": "fixed_float_max"},
}
_SHOWN = ("vehicle", "drone")
_AXES = {
    "attitude": ("attitude, deg", "roll"),
    "v": ("velocity, m/s", "pitch"),
    "p": ("position, m", "heading"),
}


def render(flown: Mapping[str, Runs], targets: Sequence[Target], seed: int, runs: int) -> str:
    """HTML text: no script, nothing outside."""
    return render_cases(
        "ins_gnss",
        _INTRO,
        targets,
        flown,
        seed=seed,
        runs=runs,
        meanings={name: case.meaning for name, case in CASES.items()},
        columns=_COLUMNS,
        text="Errors of attitude, velocity and position.",
        plots={
            name: error_history(flown[name].shown, _AXES, step_s=DT, height=4.2, name=name)
            for name in _SHOWN
        },
    )
