"""A world with draws and an estimator with a covariance, both of a few lines, for campaigns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from boresight import Estimator, Input, Output, Param, State, World


class Constant(World):
    """A constant, drawn with a spread of two, in noise of one; sixty records."""

    def __init__(self, records: int = 60) -> None:
        self.records = records
        self.draw(0)

    def draw(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.value, self.noise = 2.0 * rng.normal(), rng.normal(size=self.records)
        self.start()

    def start(self) -> None:
        self.k = 0

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        if self.k >= self.records:
            return None
        self.k += 1
        return {"z": float(self.value + self.noise[self.k - 1]), "mean_true": float(self.value)}

    def bound(self) -> dict[str, Any]:
        """Of a prior of two."""
        return {"mean": 1.0 / np.sqrt(0.25 + np.arange(1.0, self.records + 1.0))}


class Mean(Estimator):
    """The Kalman filter of a constant."""

    inputs = (Input("z", -32.0, 32.0),)
    params = (Param("p0", 4.0, 0.01, 16.0),)
    states = (State("m", -32.0, 31.9), State("p", 0.0, 16.0, "", 4.0))
    outputs = (Output("mean"), Output("nis"))
    nis_freedom = 1

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        from boresight import ops

        gain = ops.bounded(x.p / (x.p + 1.0), 0.0, 1.0, "of one constant")
        nu = u.z - x.m
        m = ops.bounded(x.m + gain * nu, -32.0, 31.9, "a mean")
        nis = ops.bounded((nu * nu) * (1.0 / (x.p + 1.0)), 0.0, 4096.0, "of a few")
        return {"m": m, "p": ops.bounded(gain, 0.0, 16.0, "P")}, {"mean": m, "nis": nis}

    def error_covariance(self, states: Any, params: Any) -> Any:
        return ("mean",), states["p"][:, None, None]
