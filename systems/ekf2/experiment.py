"""PX4's EKF2: every case, and its figures."""

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
    world, estimator = Flight, Filter
    configs = (CONFIG,)
    cases = {
        "flight": Case("all measurements"),
        "outage": Case("20 s without satellites", _OUT),
        "outage_no_air": Case("20 s without satellites, nothing of the air", {**_OUT, **_AIR}),
        "no_field": Case("no magnetometer", {"without": ("field", "declination")}),
    }
    columns = {
        "attitude, rms, deg": "attitude_rms",
        "velocity, rms, m/s": "velocity_rms",
        "position, rms, m": "position_rms",
        "wind, rms, m/s": "wind_rms",
        "terrain, rms, m": "terrain_rms",
        "drift, most, m": "drift_max",
        "fixed less float64, most, deg": "fixed_float_max",
    }

    @staticmethod
    def figures(
        case: Case, world: Flight, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> dict[str, Any]:
        """Degrees, m, m/s."""
        figures, late = errors_of(loop, reference, [world.outage], DT, "ned")
        error = {n: loop.outputs[n] - truth for n, truth in loop.truth.items()}
        wind = np.hypot(error["wind_n"], error["wind_e"])
        figures["wind_rms"] = np.sqrt(np.mean(wind[late] ** 2, axis=0))
        figures["terrain_rms"] = np.sqrt(np.mean(error["terrain"][late] ** 2, axis=0))
        return figures
