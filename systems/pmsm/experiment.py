"""The sensorless drive: every machine, its figures, its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.pmsm.estimator import DT
from boresight.systems.pmsm.estimator import Pmsm as Core
from boresight.systems.pmsm.world import LOADS_S, MACHINES, REVERSAL_S, SPEED, START_S, Motor

SETTLED_S = 0.25  #: time before which angle and speed are not judged.


class Pmsm(CasesExperiment):
    """Sensorless motor drive at 20 kHz: start, load steps, reversal, machines that are off."""

    runs = 25
    world, estimator, step_s = Motor, Core, DT
    cases = {name: Case(machine.meaning, {"machine": name}) for name, machine in MACHINES.items()}
    intro = """
        Forced start from any angle, load from 0.3 to 0.45 s, reversal at 0.5 s, load again.
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

    @staticmethod
    def figures(
        case: Case, world: Motor, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Electrical degrees, rad/s and s.

        ``loops_max``: speed of the first run's machine, less that around a core in float64.
        """
        first_world = Motor(**case.world, seeds=world.seeds[:1])
        floating = close_loop(first_world, make_level("float", Build(Core())), keep=("omega",))
        out, truth = loop.outputs, loop.truth
        angle = 180.0 * wrapped(out["theta"] - truth["theta"], 2.0)
        speed = out["omega"] - truth["omega"]
        start, back = round(SETTLED_S / DT), round(REVERSAL_S / DT)
        first, last = (round(t / DT) for t in LOADS_S[0])
        turned = truth["omega"][back:] < -0.9 * SPEED
        loops = truth["omega"][:, 0] - floating.truth["omega"]
        fixed_float = wrapped(out["theta"][:, 0] - reference["theta"], 2.0)
        return {
            "start_max": np.abs(angle[round(START_S / DT)]),
            "angle_rms": np.sqrt(np.mean(angle[start:] ** 2, axis=0)),
            "angle_max": np.abs(angle[start:]).max(axis=0),
            "speed_rms": np.sqrt(np.mean(speed[start:] ** 2, axis=0)),
            "dip_max": SPEED - truth["omega"][(first + last) // 2 : last].min(axis=0),
            "reversal_max": DT * np.where(turned.any(axis=0), turned.argmax(axis=0), len(turned)),
            "fixed_float_max": 180.0 * np.abs(fixed_float).max(),
            "loops_max": np.abs(loops[start:]).max(),
        }, {
            "speed, rad/s": {"estimated": out["omega"][:, 0], "true": truth["omega"][:, 0]},
            "angle, deg": {"error": angle[:, 0]},
        }
