"""Small estimators for tests of what is around a core."""

from __future__ import annotations

from typing import Any

from boresight.model.declarations import Input, Output, Param, State
from boresight.model.estimator import Estimator


class Track(Estimator):
    """Position and velocity from noisy positions."""

    inputs = (
        Input("dt", 0.0, 0.1, "s", meaning="time |\n    step"),
        Input("z", -100.0, 100.0, "m", missing=-100.0),
        Input("seen", 0.0, 1.0, valid_of="z"),
        Input("w", -1.0, 1.0, "ht", missing="hold"),
    )
    params = (Param("gain", 0.2, 0.0, 1.0, "", "share of the innovation taken"),)
    states = (State("pos", -128.0, 128.0, "m", initial=3.0), State("vel", -16.0, 16.0, "m/s"))
    outputs = (
        Output("pos", "m", tolerance=1e-3, meaning="where it is"),
        Output("vel", "m/s", tolerance=1e-3),
        Output("status", "bits"),
    )
    status_bits = {0: "no position seen", 2: "never"}

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        ahead = x.pos + u.dt * x.vel
        taken = p.gain * u.seen * (u.z - ahead)
        kept = {"pos": ahead + taken, "vel": x.vel + taken}
        return kept, {**kept, "status": 1.0 - u.seen}
