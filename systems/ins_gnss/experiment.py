"""Inertial navigation with satellite fixes: every case, its figures, its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.worlds.loop import Loop
from boresight.systems.ins_gnss.estimator import DT
from boresight.systems.ins_gnss.estimator import InsGnss as Filter
from boresight.systems.ins_gnss.world import Journey
from boresight.systems.worlds.navigation import errors_of

_LEVER = {"lever_x": 0.8, "lever_y": -0.3, "lever_z": 1.2}
_PROMPT = {**_LEVER, "delay": 0.0}
_DRONE = {"carrier": "drone"}
_TUNNELS = tuple((15.0 * k, 15.0 * k + 5.0) for k in range(1, 8))


class InsGnss(CasesExperiment):
    """Inertial navigation with satellite fixes: vehicle, drone, outages, lever arm, delays."""

    name = "ins_gnss"
    runs = 20
    world, estimator, step_s, log = Journey, Filter, DT, True
    configs = ("small-1024",)
    cases = {
        "vehicle": Case("vehicle, 20 s without fixes", {}, _LEVER),
        "drone": Case("drone, 20 s without fixes", _DRONE, _LEVER),
        "open_sky": Case("drone, fixes all the time", {**_DRONE, "outages": ()}, _LEVER),
        "tunnels": Case("vehicle, 5 s of every 15 without fixes", {"outages": _TUNNELS}, _LEVER),
        "prompt": Case("drone, fixes without delay", {**_DRONE, "delay": 0.0}, _PROMPT),
        "delay_unknown": Case("drone, delay of 0.1 s taken as none", _DRONE, _PROMPT),
        "lever_unknown": Case("drone, antenna taken to be at the sensor", _DRONE),
    }
    intro = """
        Inertial sensors at 100 Hz, fixes of 1 m and 0.1 m/s at 10 Hz, 0.1 s late, of an antenna
        1.5 m away. {runs} runs of the integer program, seeds {seed} to {last}, two minutes
        each; figures after half a minute, without the outages and two seconds after them.
        Drift: most position error within an outage.
    """
    columns = {
        "attitude, rms, deg": "attitude_rms",
        "most, deg": "attitude_max",
        "velocity, rms, m/s": "velocity_rms",
        "position, rms, m": "position_rms",
        "drift, most, m": "drift_max",
        "fixed less float64, most, deg": "fixed_float_max",
    }
    shown = ("vehicle", "drone")
    shown_text = "Errors of attitude, velocity and position."

    @staticmethod
    def figures(
        case: Case, world: Journey, loop: Loop, reference: Mapping[str, FloatArray]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Degrees, m, m/s."""
        return errors_of(loop, reference, world.outages, DT, "enu")[:2]
