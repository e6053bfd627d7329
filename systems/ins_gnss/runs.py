"""One case, run by the integer C, and its figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from boresight.sim.experiments.forms import run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import angle_between
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.ins_gnss.estimator import DT, InsGnss
from boresight.systems.ins_gnss.world import Journey

CONFIG = "small-1024"
SETTLED_S = 30.0  #: time before which nothing is judged.
_LEVER = {"lever_x": 0.8, "lever_y": -0.3, "lever_z": 1.2}
_PROMPT = {**_LEVER, "delay": 0.0}
_DRONE = {"carrier": "drone"}
_TUNNELS = tuple((15.0 * k, 15.0 * k + 5.0) for k in range(1, 8))


@dataclass(frozen=True)
class Case:
    """Options of `Journey`, and the filter's parameters that differ from its defaults."""

    meaning: str
    world: Mapping[str, Any]
    params: Mapping[str, float] = field(default_factory=lambda: _LEVER)


CASES = {
    "vehicle": Case("vehicle, 20 s without fixes", {}),
    "drone": Case("drone, 20 s without fixes", _DRONE),
    "open_sky": Case("drone, fixes all the time", {**_DRONE, "outages": ()}),
    "tunnels": Case("vehicle, 5 s of every 15 without fixes", {"outages": _TUNNELS}),
    "prompt": Case("drone, fixes without delay", {**_DRONE, "delay": 0.0}, _PROMPT),
    "delay_unknown": Case("drone, delay of 0.1 s taken as none", _DRONE, _PROMPT),
    "lever_unknown": Case("drone, antenna taken to be at the sensor", _DRONE, {}),
}


def run(name: str, seeds: range) -> Runs:
    """Run a case with these seeds."""
    case = CASES[name]
    world = Journey(seeds=seeds, **case.world)
    build = Build(InsGnss(), config=CONFIG, params=[case.params])
    return figures_of(case, world, close_loop(world, make_level("c", build, runs=world.runs)))


def figures_of(case: Case, world: Journey, loop: Loop) -> Runs:
    """Figures of each run after half a minute: degrees, m, m/s.

    Shown of the first run: errors of attitude [deg], velocity and position (n,).
    """
    assert loop.run.saturated is not None
    out, truth = loop.outputs, loop.truth
    start, t = round(SETTLED_S / DT), DT * np.arange(len(loop.inputs))
    attitude = np.degrees(angle_between(attitude_of(out), attitude_of(truth)))
    errors = {
        kind: np.sqrt(sum((out[kind + c] - truth[kind + c]) ** 2 for c in "enu")) for kind in "vp"
    }
    blind = np.zeros(len(t), dtype=bool)
    for begin, end in world.outages:
        blind |= (begin <= t) & (t < end + 2.0)
    aided, unaided = ~blind, blind.copy()
    aided[:start] = unaided[:start] = False
    ((reference,),) = run_forms(
        InsGnss(), [loop.inputs[:, 0]], params=case.params, levels=("float",)
    )
    fixed = angle_between(attitude_of(out)[:, 0], attitude_of(reference.outputs))
    figures = {
        "attitude_rms": np.sqrt(np.mean(attitude[start:] ** 2, axis=0)),
        "attitude_max": attitude[start:].max(axis=0),
        "velocity_rms": np.sqrt(np.mean(errors["v"][aided] ** 2, axis=0)),
        "position_rms": np.sqrt(np.mean(errors["p"][aided] ** 2, axis=0)),
        "drift_max": errors["p"][unaided].max(axis=0, initial=0.0),
        "fixed_float_max": np.full(world.runs, np.degrees(fixed.max())),
        "saturated_sum": loop.run.saturated.sum(axis=0).astype(float),
    }
    shown = {"attitude": attitude[:, 0], "v": errors["v"][:, 0], "p": errors["p"][:, 0]}
    return Runs(figures, shown)
