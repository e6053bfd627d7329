"""The sensorless drive: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boresight.sim.experiments.cases import CasesExperiment
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.systems.pmsm.estimator import DT
from boresight.systems.pmsm.estimator import Pmsm as Core
from boresight.systems.pmsm.runs import run
from boresight.systems.pmsm.world import MACHINES


class Pmsm(CasesExperiment):
    """Sensorless motor drive at 20 kHz: start, load steps, reversal, machines that are off."""

    runs = 25
    cases = MACHINES
    at_once = 25
    run_case = staticmethod(run)
    intro = """
        One core has the currents of a machine and answers with the next voltage, 20,000
        times a second: Kalman filter of four states, speed and current controllers, no
        sensor at the rotor. Forced start from any angle, load from 0.3 to 0.45 s, reversal
        at 0.5 s, load again.

        {runs} runs of the integer program in closed loop, seeds {seed} to {last}; angle and
        speed from 0.25 s on, in electrical degrees. Nothing is tuned for a case.
    """
    columns = {
        "angle, rms, deg": "angle_rms",
        "most, deg": "angle_max",
        "speed, rms, rad/s": "speed_rms",
        "at the end of the start, most, deg": "start_max",
        "slower under load, rad/s": "dip_max",
        "reversed within, s": "reversal_max",
        "fixed less float64, most, deg": "fixed_float_max",
        "loops, fixed less float64, most, rad/s": "loops_max",
    }
    shown = ("known", "warm", "dead_time")
    shown_text = "Speed, true and estimated, and error of the angle."

    def cycles(self) -> Mapping[str, float]:
        figures: dict[str, float] = {}
        for config, (schedule,) in schedules_of(Core()).items():
            figures[f"interval_cycles_{config}"] = schedule.interval
            figures[f"voltage_cycles_{config}"] = max(schedule.latencies[:2])
        return figures

    def plot(self, runs: Runs, name: str) -> str:
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
