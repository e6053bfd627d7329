"""One machine, driven by the integer C in closed loop, and its figures."""

from __future__ import annotations

import numpy as np

from boresight.sim.experiments.forms import differences_of, run_forms
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.pmsm.estimator import DT, Pmsm
from boresight.systems.pmsm.world import LOADS_S, REVERSAL_S, SPEED, START_S, Motor

SETTLED_S = 0.25  #: time before which angle and speed are not judged.
_KEPT = ("theta", "omega")


def run(machine: str, seeds: range) -> Runs:
    """Drive a machine with these seeds; the first also by a core in float64."""
    motors, build = Motor(machine, seeds), Build(Pmsm())
    loop = close_loop(motors, make_level("c", build, runs=motors.runs), keep=_KEPT)
    floating = close_loop(Motor(machine, seeds[:1]), make_level("float", build), keep=_KEPT)
    return figures_of(loop, floating)


def figures_of(loop: Loop, floating: Loop) -> Runs:
    """Figures of each run, in electrical degrees, rad/s and s.

    Shown of the first run: angle error (n,) [deg], estimated and true speed (n, 2) [rad/s].
    ``floating`` is the loop of the first run around float64: the machines' speeds are compared, and
    the estimates on the records of the integers.
    """
    assert loop.run.saturated is not None
    out, truth = loop.outputs, loop.truth
    runs = out["theta"].shape[1]
    angle = 180.0 * wrapped(out["theta"] - truth["theta"], 2.0)
    speed = out["omega"] - truth["omega"]
    start, back = round(SETTLED_S / DT), round(REVERSAL_S / DT)
    first, last = (round(t / DT) for t in LOADS_S[0])
    turned = truth["omega"][back:] < -0.9 * SPEED
    loops = truth["omega"][:, 0] - floating.truth["omega"]
    ((reference,),) = run_forms(Pmsm(), [loop.inputs[:, 0]], levels=("float",))
    differences = differences_of({"theta": out["theta"][:, 0]}, reference.outputs, ("theta",), 2.0)
    figures = {
        "start_max": np.abs(angle[round(START_S / DT)]),
        "angle_rms": np.sqrt(np.mean(angle[start:] ** 2, axis=0)),
        "angle_max": np.abs(angle[start:]).max(axis=0),
        "speed_rms": np.sqrt(np.mean(speed[start:] ** 2, axis=0)),
        "dip_max": SPEED - truth["omega"][(first + last) // 2 : last].min(axis=0),
        "reversal_max": DT * np.where(turned.any(axis=0), turned.argmax(axis=0), len(turned)),
        "saturated_sum": loop.run.saturated.sum(axis=0).astype(float),
        "fixed_float_max": np.full(runs, 180.0 * np.abs(differences).max()),
        "loops_max": np.full(runs, np.abs(loops[start:]).max()),
    }
    shown = {"angle": angle[:, 0], "speed": np.stack([out["omega"], truth["omega"]], 2)[:, 0]}
    return Runs(figures, shown)
