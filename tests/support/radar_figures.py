"""Runs, theory and figures of the radar experiment that are made up, for tests of both."""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.targets import targets_of
from boresight.systems.radar.experiment import figures
from boresight.systems.radar.interface import BIASES
from boresight.systems.radar.runs import Predicted, Watched

N = 1701
SHARES = np.array([0.01, -0.001, 0.0005, -0.015, 0.001, -0.0002])


def watched(scale: float) -> Watched:
    error = np.tile(scale * SHARES, (N, 1))
    before, after = np.full((N, 2, 3), 200.0), np.full((N, 2, 3), 4.0 * scale)
    before[1000, 0] = np.nan  # missed
    after[1000, 0] = np.nan
    return Watched(np.arange(N) * np.float64(0.1), error, before, after, 0, 1e-4)


def theory() -> Predicted:
    ones = np.ones((N, 6))
    return Predicted(50.0 * ones, ones, 2.0 * ones, 0.5 * ones, ones[:, :3], ones[0] / 6**0.5, 1e6)


def spread(sd: float = 2.0, mean: float = 0.55) -> dict[str, Any]:
    entry = {"sd": [9.0, sd], "mean": [9.0, mean], "mean_band": [9.0, 0.1]}
    nis = {"mean": 1.0, "band": [0.9, 1.1], "freedom": 3}
    outputs = {f"{b}_bias": entry for b in BIASES}
    return {"outputs": outputs, "runs": 20, "nis": nis, "saturated": 0}


def found(**more: float) -> dict[str, float]:
    data = figures(watched(1.0), watched(10.0), theory(), spread(), {"a": 0.01, "b": 0.02})
    cycles = {f"registration_interval_cycles_{c}": 700.0 for c in ("small", "fast")}
    return data | cycles | more


def targets(**more: float) -> tuple[Target, ...]:
    return targets_of("boresight.systems.radar", found(**more))
