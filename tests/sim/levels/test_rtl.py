"""The core's Verilog as a level, live in a process of its own."""

from __future__ import annotations

import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import build_core
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.levels.integer import Interpreted
from boresight.sim.levels.rtl import Simulated
from boresight.sim.rtl.simulators import SimulationFailed


class Leaky(Estimator):
    """A low pass: words of both signs, saturation, a state that starts at 1."""

    inputs = (Input("u", -2.0, 2.0, "m"), Input("v", -1.0, 1.0, "m"))
    states = (State("y", -0.5, 0.5, "m", 0.25),)
    outputs = (Output("y", "m"), Output("sum", "m"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + 0.5 * (u.u - x.y)
        return {"y": y}, {"y": y, "sum": y - 3.0 * u.v}


def running(process: subprocess.Popen[bytes]) -> bool:
    return process.poll() is None


def test_live_core() -> None:
    """One build: words, cycles, resets, and the process's end."""
    core = build_core(Leaky().compile(word=18), "small")
    records = np.random.default_rng(3).uniform(-1, 1, (60, 2)) * [2.0, 1.0]
    wanted = Interpreted(core.program).run(records)
    assert wanted.saturated is not None and wanted.words is not None
    assert (wanted.words < 0).any() and wanted.saturated.any() and not wanted.saturated.all()

    level = Simulated(core)
    level.close()  # nothing to close yet
    for _ in range(2):  # the second time after a reset in the middle
        for k in range(20):
            assert level.step(records[k]) == {n: v[k] for n, v in wanted.outputs.items()}
        level.reset()
    found = [level.step(record) for record in records]
    for name, values in wanted.outputs.items():
        assert [step[name] for step in found] == values.tolist()

    process, folder = level._process, Path(str(level._folder and level._folder.name))
    assert process is not None and running(process) and folder.is_dir()
    level.close()
    assert not running(process) and not folder.exists()
    assert level._process is None and level._folder is None
    level.close()

    # Another schedule than the core's: its cycles are counted, so it shows.
    schedule = SimpleNamespace(interval=core.schedule.interval + 1)
    level.core = SimpleNamespace(schedule=schedule, parts=core.parts, number=core.number)  # type: ignore[assignment]
    took = f"took {core.schedule.interval} cycles, the schedule says {core.schedule.interval + 1}$"
    with pytest.raises(SimulationFailed, match=f"^rtl: the update {took}"):
        level.step(records[0])
    level.close()
    # One that is far too short: the update does not end in time.
    schedule.interval = -15
    with pytest.raises(SimulationFailed, match="^rtl: 2 output words expected, -1 came$"):
        level.step(records[0])
    process = level._process
    assert process is not None
    process.kill()
    process.wait()
    with pytest.raises(SimulationFailed, match="^rtl: the simulation has ended$"):
        level.step(records[0])
    level.close()


def test_what_was_never_made_is_closed_quietly() -> None:
    class Broken:
        program = None

        def verilog(self, instances: bool) -> str:
            raise OSError("no room")

    with pytest.raises(OSError, match="no room"):
        Simulated(Broken())  # type: ignore[arg-type]
