"""Inertial navigation with satellite fixes: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Mapping

from boresight.sim.experiments.cases import CasesExperiment
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.plotting import error_history
from boresight.systems.ins_gnss.estimator import DT
from boresight.systems.ins_gnss.estimator import InsGnss as Filter
from boresight.systems.ins_gnss.runs import CASES, CONFIG, run

_AXES = {
    "attitude": ("attitude, deg", "roll"),
    "v": ("velocity, m/s", "pitch"),
    "p": ("position, m", "heading"),
}


class InsGnss(CasesExperiment):
    """Inertial navigation with satellite fixes: vehicle, drone, outages, lever arm, delays."""

    name = "ins_gnss"
    runs = 20
    cases = CASES
    at_once = 20
    run_case = staticmethod(run)
    intro = """
        15 error states: attitude, velocity, position, biases of gyro and accelerometer.
        Inertial sensors at 100 Hz, fixes of 1 m and 0.1 m/s at 10 Hz, 0.1 s late, of an
        antenna 1.5 m away.

        {runs} runs of the integer program, seeds {seed} to {last}, two minutes each;
        figures after half a minute, without the outages and two seconds after them. Drift:
        most position error within an outage.
    """
    columns = {
        "attitude, rms, deg": "attitude_rms",
        "most, deg": "attitude_max",
        "velocity, rms, m/s": "velocity_rms",
        "position, rms, m": "position_rms",
        "drift, most, m": "drift_max",
        "fixed less float64, most, deg": "fixed_float_max",
    }
    shown = ("vehicle", "drone")
    shown_text = "Errors of attitude, velocity and position."

    def cycles(self) -> Mapping[str, float]:
        schedule = Build(Filter(), config=CONFIG).core.schedule
        return {"interval_cycles": schedule.interval, "state_cycles": max(schedule.latencies)}

    def plot(self, runs: Runs, name: str) -> str:
        return error_history(runs.shown, _AXES, step_s=DT, height=4.2, name=name)
