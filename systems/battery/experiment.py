"""The cell: every case, its figures, its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.worlds.loop import Loop
from boresight.systems.battery.estimator import CAPACITY, DT, R_0, R_FAST, R_SLOW
from boresight.systems.battery.estimator import Battery as Filter
from boresight.systems.battery.world import CELLS, Discharge

SETTLED_S = 600.0  #: time before which the charge is not judged.


def _resistances(times: float) -> dict[str, float]:
    return {"r_0": times * R_0, "r_fast": times * R_FAST, "r_slow": times * R_SLOW}


class Battery(CasesExperiment):
    """State of charge of a lithium cell: loads, rest, charge; cells and sensors that are off."""

    runs = 25
    world, estimator, step_s = Discharge, Filter, DT
    cases = {name: Case(cell.meaning, {"cell": name}) for name, cell in CELLS.items()} | {
        "aged_told": Case(
            "aged, the filter has its capacity and resistances",
            {"cell": "aged"},
            {**_resistances(1.4), "capacity": 0.85 * CAPACITY},
        ),
        "cold_told": Case(
            "cold, the filter has its resistances", {"cell": "cold"}, _resistances(2.0)
        ),
    }
    intro = """
        Two hours of changing loads, ten minutes of rest, a charge; the filter begins at half,
        the cell nearly full. {runs} runs of the integer program, seeds {seed} to {last}; charges
        as shares of a full cell, after ten minutes. Counted: the sum of the measured current
        alone, from the true charge on.
    """
    columns = {
        "charge, rms": "charge_rms",
        "most": "charge_max",
        "counted, most": "counted_max",
        "within 0.02 after, s (7,200: never)": "known_s_max",
        "NIS": "nis",
        "fixed less float64, most": "fixed_float_max",
    }
    shown = ("known", "offset", "cold")
    shown_text = "Charge, true and estimated; error, and three standard deviations."

    @staticmethod
    def figures(
        case: Case, world: Discharge, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Charges as shares of a full cell, seconds.

        ``counted_max``: error of a sum of the measured current that begins at the true charge.
        """
        z, truth = loop.outputs["z"], loop.truth["z"]
        error, start = z - truth, round(SETTLED_S / DT)
        within = np.abs(error) < 0.02
        lasting = np.logical_and.accumulate(within[::-1])[::-1]
        settling_steps = np.where(lasting.any(axis=0), lasting.argmax(axis=0), len(within))
        current = loop.inputs[..., [i.name for i in Filter.inputs].index("i")]
        capacity = 3600.0 * case.params.get("capacity", CAPACITY)
        counted = truth[0] - np.cumsum(DT * current[1:], axis=0) / capacity - truth[1:]
        sd = 3.0 * loop.outputs["sd_z"][:, 0]
        return {
            "charge_rms": np.sqrt(np.mean(error[start:] ** 2, axis=0)),
            "charge_max": np.abs(error[start:]).max(axis=0),
            "counted_max": np.abs(counted).max(axis=0),
            "known_s_max": DT * settling_steps,
            "nis": loop.outputs["nis"][start:].mean(axis=0),
            "fixed_float_max": np.abs(z[:, 0] - reference["z"]).max(),
        }, {
            "charge": {"estimated": z[:, 0], "true": truth[:, 0]},
            "error": {"error": error[:, 0], "3 sd": sd, "-3 sd": -sd},
        }
