"""The judgement of an offload, on a board that is played; test_system.py runs the real one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.estimators.complementary import Complementary
from boresight.sim.board.setup import SCALED
from boresight.sim.soc import offload as module
from boresight.sim.soc.offload import offload

pytestmark = pytest.mark.without_compiler
N = 6


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Update 3 of six has not been seen in memory; the first two wait for the firmware."""
    program = Complementary().compile()
    inputs = np.random.default_rng(1).integers(-(2**20), 2**20, (N - 1, len(program.inputs)))
    outputs, _ = CModel(program).update(inputs)
    updates = 1_000 * np.arange(1, N + 1)
    seen = np.delete(np.arange(N), 3)
    newest = SimpleNamespace(
        inputs=inputs,
        outputs=outputs.copy(),
        header=(seen + 1) | 5 << 16,
        complete=updates[seen] + [9_000, 8_000, 160, 180, 200],
    )
    run = SimpleNamespace(
        newest=newest,
        updates=updates,
        samples=np.append(updates - [300, 310, 320, 310, 300, 305], 7_000),
        cycles=8_000,
        seconds=1.234,
    )
    monkeypatch.setattr(
        module, "attitude_image", lambda system, ram: SimpleNamespace(code_size=7, data_size=ram)
    )
    monkeypatch.setattr(module, "stimulus", lambda log, board: ("stimulus", log, board.setup))
    asked: list[Any] = []
    core = SimpleNamespace(parts=[SimpleNamespace(program=program)])
    return SimpleNamespace(
        board=SimpleNamespace(system="system", core=core, setup=SCALED),
        ram=64,
        run=lambda image, what, updates: asked.append((what, updates)) or run,
        asked=asked,
        newest=newest,
    )


def test_figures(bench: Any) -> None:
    log: Any = "log"
    data = offload(bench, log, updates=N)
    assert bench.asked == [(("stimulus", "log", SCALED), N)]
    assert (data["estimator"], data["updates"], data["in_memory"]) == ("complementary", N, N - 1)
    assert data["mismatches"] == 0
    assert data["sample_to_update_cycles"] == {"min": 300, "max": 320}
    assert data["update_to_memory_cycles"] == {"median": 180, "max": 200}
    assert (data["code_bytes"], data["data_bytes"], data["simulation_seconds"]) == (7, 64, 1.23)
    assert data["setup"]["clock_hz"] == SCALED.clock_hz


def test_every_wrong_update_counts_once(bench: Any) -> None:
    bench.newest.outputs[1, :2] ^= 1
    bench.newest.outputs[4, -1] ^= 1
    log: Any = "log"
    assert offload(bench, log)["mismatches"] == 2
