"""The cell: every case, its targets, its page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boresight.sim.experiments.cases import CasesExperiment
from boresight.sim.experiments.forms import schedules_of
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.systems.battery.estimator import DT
from boresight.systems.battery.estimator import Battery as Filter
from boresight.systems.battery.runs import CASES, run


class Battery(CasesExperiment):
    """State of charge of a lithium cell: loads, rest, charge; cells and sensors that are off."""

    runs = 25
    cases = CASES
    at_once = 25
    run_case = staticmethod(run)
    intro = """
        A Kalman filter of three states has the current and the voltage of a lithium cell
        once a second: its charge, and the voltages of two elements of its equivalent
        circuit. Two hours of changing loads, ten minutes of rest, a charge; the filter
        begins at half, the cell nearly full.

        {runs} runs of the integer program, seeds {seed} to {last}; charges as shares of a
        full cell, after ten minutes. Counted: the sum of the measured current alone, from
        the true charge on.
    """
    columns = {
        "charge, rms": "charge_rms",
        "most": "charge_max",
        "counted, most": "counted_max",
        "within 0.02 for good after, s": "known_s_max",
        "NIS": "nis",
        "fixed less float64, most": "fixed_float_max",
    }
    shown = ("known", "offset", "cold")
    shown_text = "Charge, true and estimated; error, and three standard deviations."

    def cycles(self) -> Mapping[str, float]:
        figures: dict[str, float] = {}
        for config, (schedule,) in schedules_of(Filter()).items():
            figures[f"charge_cycles_{config}"] = schedule.latencies[0]
            figures[f"interval_cycles_{config}"] = schedule.interval
        return figures

    def plot(self, runs: Runs, name: str) -> str:
        z, truth, sd = runs.shown["charge"][::10].T
        hours = 10.0 * DT / 3600.0 * np.arange(len(z))
        with settings():
            figure, (upper, lower) = figure_and_axes(3.6, 2, sharex=True)
            upper.plot(hours, z, color=COLOUR["roll"], label="estimated", linewidth=0.8)
            upper.plot(hours, truth, color=COLOUR["grey"], label="true", linewidth=0.8)
            lower.plot(hours, z - truth, color=COLOUR["pitch"], linewidth=0.8)
            for side in (-3.0, 3.0):
                lower.plot(hours, side * sd, color=COLOUR["grey"], linewidth=0.6)
            limit = 1.2 * float(np.abs((z - truth)[len(z) // 12 :]).max())
            lower.set_ylim(-limit, limit)
            upper.set_ylabel("charge")
            lower.set_ylabel("error")
            lower.set_xlabel("time, h")
            legend(upper, 2)
            return svg(figure, name)
