"""Cycles of estimators in hardware, as an experiment's figures have them."""

from __future__ import annotations

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.slots import Schedule
from boresight.model.estimator import Estimator
from boresight.sim.levels.build import Build

__all__ = ["schedules_of"]


def schedules_of(*estimators: Estimator) -> dict[str, tuple[Schedule, ...]]:
    """Schedules of estimators that share a core, in their order, for "small" and "fast".

    ``interval`` of each is the cycles from one record to the next, ``latency`` those to the last of
    its urgent outputs.

    Raises
    ------
    ScheduleError
        They do not fit into one core.
    """
    return {
        config: tuple(part.schedule for part in Build(*estimators, config=config).core.parts)
        for config in CONFIGS
    }
