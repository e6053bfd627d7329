"""One case, run by the integer C, and its figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from boresight.sim.experiments.forms import run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.battery.estimator import CAPACITY, DT, R_0, R_FAST, R_SLOW, Battery
from boresight.systems.battery.world import CELLS, Discharge

SETTLED_S = 600.0  #: time before which the charge is not judged.


@dataclass(frozen=True)
class Case:
    """A cell, and the filter's parameters that differ from its defaults."""

    meaning: str
    cell: str
    params: Mapping[str, float] = field(default_factory=dict)


def _resistances(times: float) -> dict[str, float]:
    return {"r_0": times * R_0, "r_fast": times * R_FAST, "r_slow": times * R_SLOW}


CASES = {name: Case(cell.meaning, name) for name, cell in CELLS.items()} | {
    "aged_told": Case(
        "aged, the filter has its capacity and resistances",
        "aged",
        {**_resistances(1.4), "capacity": 0.85 * CAPACITY},
    ),
    "cold_told": Case("cold, the filter has its resistances", "cold", _resistances(2.0)),
}


def run(name: str, seeds: range) -> Runs:
    """Run a case with these seeds."""
    case = CASES[name]
    world, build = Discharge(case.cell, seeds), Build(Battery(), params=[case.params])
    return figures_of(case, close_loop(world, make_level("c", build, runs=world.runs)))


def figures_of(case: Case, loop: Loop) -> Runs:
    """Figures of each run: charges as shares of a full cell, seconds.

    ``counted_max`` is the error of a sum of the measured current that begins at the true charge.
    Shown of the first run: charge, estimated and true, and standard deviation (n, 3).
    """
    assert loop.run.saturated is not None
    z, truth, runs = loop.outputs["z"], loop.truth["z"], loop.truth["z"].shape[1]
    error, start = z - truth, round(SETTLED_S / DT)
    within = np.abs(error) < 0.02
    lasting = np.logical_and.accumulate(within[::-1])[::-1]
    settling_steps = np.where(lasting.any(axis=0), lasting.argmax(axis=0), len(within))
    current = loop.inputs[..., [i.name for i in Battery.inputs].index("i")]
    capacity = 3600.0 * case.params.get("capacity", CAPACITY)
    counted = truth[0] - np.cumsum(DT * current[1:], axis=0) / capacity - truth[1:]
    ((reference,),) = run_forms(
        Battery(), [loop.inputs[:, 0]], params=case.params, levels=("float",)
    )
    figures = {
        "charge_rms": np.sqrt(np.mean(error[start:] ** 2, axis=0)),
        "charge_max": np.abs(error[start:]).max(axis=0),
        "counted_max": np.abs(counted).max(axis=0),
        "known_s_max": DT * settling_steps,
        "nis": loop.outputs["nis"][start:].mean(axis=0),
        "fixed_float_max": np.full(runs, np.abs(z[:, 0] - reference.outputs["z"]).max()),
        "saturated_sum": loop.run.saturated.sum(axis=0).astype(float),
    }
    shown = {"charge": np.stack([z, truth, loop.outputs["sd_z"]], axis=2)[:, 0]}
    return Runs(figures, shown)
