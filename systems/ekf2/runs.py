"""One case, run by the integer C, and its figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.sim.experiments.forms import run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import angle_between
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.ekf2.estimator import DT, Ekf2
from boresight.systems.ekf2.world import Flight

CONFIG = "small-2048"
SETTLED_S = 30.0  #: time before which nothing is judged.
_AIR = ("airspeed", "sideslip", "drag")


@dataclass(frozen=True)
class Case:
    """Options of `Flight`."""

    meaning: str
    world: Mapping[str, Any]


CASES = {
    "flight": Case("all measurements", {}),
    "outage": Case("20 s without satellites", {"outage": (50.0, 70.0)}),
    "outage_no_air": Case(
        "20 s without satellites, nothing of the air", {"outage": (50.0, 70.0), "without": _AIR}
    ),
    "no_field": Case("no magnetometer", {"without": ("field", "declination")}),
}


def run(name: str, seeds: range) -> Runs:
    """Run a case with these seeds."""
    world = Flight(seeds=seeds, **CASES[name].world)
    build = Build(Ekf2(), config=CONFIG)
    return figures_of(world, close_loop(world, make_level("c", build, runs=world.runs)))


def figures_of(world: Flight, loop: Loop) -> Runs:
    """Figures of each run after half a minute: degrees, m, m/s.

    Shown of the first run: errors of attitude [deg], velocity, position and wind (n,).
    """
    assert loop.run.saturated is not None
    out, truth = loop.outputs, loop.truth
    start, t = round(SETTLED_S / DT), DT * np.arange(len(loop.inputs))
    attitude = np.degrees(angle_between(attitude_of(out), attitude_of(truth)))
    parts = {"v": ("vn", "ve", "vd"), "p": ("pn", "pe", "pd"), "wind": ("wind_n", "wind_e")}
    errors = {
        kind: np.sqrt(sum((out[n] - truth[n]) ** 2 for n in names)) for kind, names in parts.items()
    }
    begin, end = world.outage
    blind = (begin <= t) & (t < end + 2.0) if end > begin else np.zeros(len(t), dtype=bool)
    aided, unaided = ~blind, blind.copy()
    aided[:start] = unaided[:start] = False
    ((reference,),) = run_forms(Ekf2(), [loop.inputs[:, 0]], levels=("float",))
    fixed = angle_between(attitude_of(out)[:, 0], attitude_of(reference.outputs))
    ground = out["terrain"] - truth["terrain"]
    figures = {
        "attitude_rms": np.sqrt(np.mean(attitude[start:] ** 2, axis=0)),
        "attitude_max": attitude[start:].max(axis=0),
        "velocity_rms": np.sqrt(np.mean(errors["v"][aided] ** 2, axis=0)),
        "position_rms": np.sqrt(np.mean(errors["p"][aided] ** 2, axis=0)),
        "wind_rms": np.sqrt(np.mean(errors["wind"][start:] ** 2, axis=0)),
        "terrain_rms": np.sqrt(np.mean(ground[start:] ** 2, axis=0)),
        "drift_max": errors["p"][unaided].max(axis=0, initial=0.0),
        "fixed_float_max": np.full(world.runs, np.degrees(fixed.max())),
        "saturated_sum": loop.run.saturated.sum(axis=0).astype(float),
    }
    shown = {name: values[:, 0] for name, values in errors.items()}
    return Runs(figures, {"attitude": attitude[:, 0], **shown})
