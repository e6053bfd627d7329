"""PX4's EKF2: every case, its figures, its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.worlds.loop import Loop
from boresight.systems.ekf2.estimator import DT
from boresight.systems.ekf2.estimator import Ekf2 as Filter
from boresight.systems.ekf2.world import Flight
from boresight.systems.worlds.navigation import errors_of

CONFIG = "small-2048"
_OUT, _AIR = {"outage": (50.0, 70.0)}, {"without": ("airspeed", "sideslip", "drag")}


class Ekf2(CasesExperiment):
    """PX4's EKF2 in a small aeroplane: all measurements, without satellites, without others."""

    runs = 10
    world, estimator, step_s, log = Flight, Filter, DT, True
    configs = (CONFIG,)
    cases = {
        "flight": Case("all measurements"),
        "outage": Case("20 s without satellites", _OUT),
        "outage_no_air": Case("20 s without satellites, nothing of the air", {**_OUT, **_AIR}),
        "no_field": Case("no magnetometer", {"without": ("field", "declination")}),
    }
    intro = """
        One scalar measurement in each of 100 updates a second. {runs} runs of the integer
        program, seeds {seed} to {last}, 90 s each; figures after half a minute, velocity and
        position without the outages and two seconds after them. Drift: most position error
        within an outage.
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

    @staticmethod
    def figures(
        case: Case, world: Flight, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Degrees, m, m/s."""
        figures, panels, late = errors_of(loop, reference, [world.outage], DT, "ned")
        error = {n: loop.outputs[n] - truth for n, truth in loop.truth.items()}
        wind = np.hypot(error["wind_n"], error["wind_e"])
        figures["wind_rms"] = np.sqrt(np.mean(wind[late] ** 2, axis=0))
        figures["terrain_rms"] = np.sqrt(np.mean(error["terrain"][late] ** 2, axis=0))
        return figures, panels | {"wind, m/s": {"": wind[:, 0]}}
