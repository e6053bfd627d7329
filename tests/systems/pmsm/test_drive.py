"""The sensorless drive: filter and controllers in a closed loop with their machine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.pmsm.estimator import DT, Pmsm
from boresight.systems.pmsm.experiment import Pmsm as Experiment
from boresight.systems.pmsm.world import START_S, Motor


def loop(level: str, steps: int, seeds: Any = (1,)) -> Loop:
    world = Motor("known", seeds, steps)
    with make_level(level, Build(Pmsm()), runs=world.runs if len(seeds) > 1 else None) as made:
        return close_loop(world, made)


@pytest.fixture(scope="module")
def driven() -> Runs:
    return Experiment().run_case("known", range(1, 3))


def test_starts_from_any_angle() -> None:
    """64 rotors, some opposite to the current of the forced start; at its end each is known."""
    outcome = loop("c", round(START_S / DT) + 1, range(1, 65))
    angle = (outcome.outputs["theta"] - outcome.truth["theta"] + 1.0) % 2.0 - 1.0
    assert np.abs(outcome.truth["theta"][0]).max() > 0.9
    assert np.abs(angle[-1]).max() < 0.02


def test_turns_back_under_load(driven: Runs) -> None:
    outcome = driven.pooled()
    assert outcome["angle_max"] < 3.0 and outcome["reversal_max"] < 0.3
    assert outcome["fixed_float_max"] < 0.0036 and outcome["loops_max"] < 1.0
    assert outcome["saturated_sum"] == 0.0


def test_an_unknown_machine_is_refused() -> None:
    with pytest.raises(InputError, match="machine: wanted one of known, warm.*found 'cold'"):
        Motor("cold")
