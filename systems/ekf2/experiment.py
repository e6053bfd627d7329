"""PX4's EKF2: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Mapping

from boresight.sim.experiments.cases import CasesExperiment
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.plotting import error_history
from boresight.systems.ekf2.estimator import DT
from boresight.systems.ekf2.estimator import Ekf2 as Filter
from boresight.systems.ekf2.runs import CASES, CONFIG, run

_AXES = {
    **{"attitude": ("attitude, deg", "roll"), "v": ("velocity, m/s", "pitch")},
    **{"p": ("position, m", "heading"), "wind": ("wind, m/s", "roll")},
}


class Ekf2(CasesExperiment):
    """PX4's EKF2 in a small aeroplane: all measurements, without satellites, without others."""

    runs = 10
    cases = CASES
    at_once = 10
    run_case = staticmethod(run)
    intro = """
        24 error states of PX4's EKF2: attitude, velocity, position, biases of gyro and
        accelerometer, earth's and body's magnetic field, wind, terrain; one scalar
        measurement in each of 100 updates a second.

        {runs} runs of the integer program, seeds {seed} to {last}, 90 s each; figures after
        half a minute, velocity and position without the outages and two seconds after them.
        Drift: most position error within an outage.
    """
    columns = {
        "attitude, rms, deg": "attitude_rms",
        "velocity, rms, m/s": "velocity_rms",
        "position, rms, m": "position_rms",
        "wind, rms, m/s": "wind_rms",
        "terrain, rms, m": "terrain_rms",
        "drift, most, m": "drift_max",
        "fixed less float64, most, deg": "fixed_float_max",
    }
    shown = ("flight", "outage")
    shown_text = "Errors of attitude, velocity, position and wind."

    def cycles(self) -> Mapping[str, float]:
        schedule = Build(Filter(), config=CONFIG).core.schedule
        return {"interval_cycles": schedule.interval, "state_cycles": max(schedule.latencies)}

    def plot(self, runs: Runs, name: str) -> str:
        return error_history(runs.shown, _AXES, step_s=DT, height=5.2, name=name)
