"""A smoother with an argument, and a log of it, for tests of explorations."""

from typing import Any

from boresight import Estimator, Input, Output, Record, State


class Smooth(Estimator):
    """A smoother whose constructor refuses a negative shift."""

    inputs = (Input("a", -1.0, 1.0),)
    states = (State("m", -1.0, 1.0),)
    outputs = (Output("m", tolerance=1e-3), Output("cycles"))

    def __init__(self, shift: int = 3) -> None:
        if shift < 0:
            raise ValueError("negative shift")
        self.gain = 2.0**-shift

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        m = (1.0 - self.gain) * x.m + self.gain * u.a
        return {"m": m}, {"m": m, "cycles": u.a}


LOG = Record.of({"a": [0.3, -0.6, 0.9], "m_true": [0.1, float("nan"), 0.2]}, name="log")
