"""The closed loop: what the phases send to the receiver decides which beams are asked for next."""

import numpy as np
import pytest

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.mls.phases import ArrayPhases
from boresight.systems.mls.world import Landing


def fly(world: Landing, name: str = "c", config: str = "small", steps: int | None = None) -> Loop:
    with make_level(name, Build(ArrayPhases(world.array.elements), config=config)) as level:
        return close_loop(world, level, steps=steps)


def test_the_beam_stays_on_the_receiver() -> None:
    """Found by a scan of the sector, then followed; without compensation it wanders by degrees."""
    errors = {}
    for compensated in (True, False):
        world = Landing(
            "rolling", 3, -20.0, elements=16, seconds=2.2, beams=41, compensated=compensated
        )
        loop = fly(world)
        assert not loop.outputs["status"].any() and len(world.angles) >= 12
        errors[compensated] = np.abs(np.array(world.angles) + 20.0).max()
    assert errors[True] < 0.5 and errors[False] > 2.0


def test_beams_go_where_the_pulse_was() -> None:
    """The first scan covers the sector, then the gate is narrow and about the angle found."""
    world = Landing("sea_5", 2, 35.0, elements=16, seconds=1.6, beams=25)
    loop = fly(world)
    azimuth = np.degrees(np.arctan2(loop.inputs[:, 5], loop.inputs[:, 4]))
    assert (azimuth[0], azimuth[24]) == pytest.approx((-62.0, 62.0))
    assert np.abs(azimuth[75:] - 35.0).max() < 3.0
    assert np.ptp(azimuth[75:100]) == pytest.approx(4.0)
    lost = Landing("sea_5", 2, 35.0, elements=16, seconds=1.6, beams=25)
    lost.start()
    outputs = None
    for _ in range(60):  # an array without a beam: it goes on looking
        record = lost.record(outputs)
        outputs = {f"phase_{k}": (k * k % 7) / 7.0 for k in range(16)}
    assert record is not None and abs(lost._half) > 3.0 and not lost.angles
