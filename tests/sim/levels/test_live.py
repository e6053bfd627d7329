"""A core in a process of its own: what it answers, and what counts as broken."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import Core, build_shared_core
from boresight.model.words.interpreter import Interpreter
from boresight.sim.levels.live import LiveCore
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.random_program import random_inputs, random_programs


@pytest.fixture(scope="module")
def core() -> Core:
    """The second of two programs."""
    return build_shared_core(random_programs(1, 2, word=18), "small", restarts=0).select(1)


def update(live: LiveCore, row: Any) -> tuple[list[int], bool]:
    words, saturated = live.update(np.array(row))
    return words.tolist(), saturated


def test_words_flags_and_the_end(core: Core) -> None:
    live, model = LiveCore(core), Interpreter(core.program)
    for row in random_inputs(core.program, 3, 30):
        out, saturated = model.update(np.array(row)[:, None])
        assert update(live, row) == (out[:, 0].tolist(), bool(saturated[0]))
    folder = Path(live.folder.name)
    assert live.process.poll() is None and folder.is_dir()
    live.close()
    assert live.process.poll() is not None and not folder.exists()


def another(core: Core, length: int) -> Core:
    """The same hardware, of which the schedule says something else."""
    part = core.parts[1]
    changed = dataclasses.replace(part, schedule=dataclasses.replace(part.schedule, length=length))
    return dataclasses.replace(core, parts=(core.parts[0], changed))


def test_other_cycles_than_the_schedule_says(core: Core) -> None:
    """Also far too few: then the update does not end in time."""
    (row,) = random_inputs(core.program, 3, 1)
    took, n = core.schedule.length, len(core.program.outputs)
    live = LiveCore(another(core, took + 1))
    said = f"^rtl: the update took {took} cycles, the schedule says {took + 1}$"
    with pytest.raises(SimulationFailed, match=said):
        update(live, row)
    live.close()
    live = LiveCore(another(core, -15))
    with pytest.raises(SimulationFailed, match=f"^rtl: {n} output words expected, -1 came$"):
        update(live, row)
    live.process.kill()
    live.process.wait()
    with pytest.raises(SimulationFailed, match="^rtl: the simulation has ended$"):
        update(live, row)
    live.close()
