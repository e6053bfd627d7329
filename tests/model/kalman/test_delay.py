"""Late measurements, and what gates let pass."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import boresight
from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State
from boresight.model.errors import InputError

DT, DELAY = 0.02, 0.1


class ByHand(Kalman):
    """Height of then, written out."""

    name = "height"
    inputs = (Input("acc", -10.0, 10.0), Input("z", -100.0, 100.0))
    states = (State("h", -100.0, 100.0, sd=4.0), State("v", -20.0, 20.0, sd=4.0))
    outputs = (Output("h", tolerance=1e-4), Output("accepted"), Output("rejected"))
    rates_hz = {"dt": 1.0 / DT}

    def f(self, x, u, p):
        dt = getattr(u, "dt", DT)
        return {"h": x.h + dt * x.v + 0.5 * dt * dt * u.acc, "v": x.v + dt * u.acc}

    def noise(self, x, u, p):
        return {"h": 1e-5, "v": 1e-4}

    def measure(self, x, u, p):
        then = x.h - DELAY * x.v + 0.5 * DELAY**2 * u.acc
        return [Measurement(u.z, then, 0.04, gate=4.0)]


class Late(ByHand):
    def measure(self, x, u, p):
        return [Measurement(u.z, x.h, 0.04, gate=4.0, delay=DELAY)]


class LateByDifference(Late):
    def f(self, x, u, p):
        return {"h": x.h - (-DT * x.v - 0.5 * DT**2 * u.acc), "v": x.v - -DT * u.acc}


class LateByInput(Late):
    inputs = (*ByHand.inputs, Input("dt", 0.0, 0.1, "s"))


class LateInMilliseconds(Late):
    inputs = (*ByHand.inputs, Input("dt", 0.0, 100.0, "ms"))

    def f(self, x, u, p):
        return super().f(x, SimpleNamespace(acc=u.acc, dt=0.001 * u.dt), p)


T = DT * np.arange(300)
LOG = {
    "acc": -4.0 * np.sin(T),
    "z": 4.0 * np.sin(T - DELAY) + np.random.default_rng(1).normal(0.0, 0.2, 300),
    "h_true": 4.0 * np.sin(T),
    "dt[s]": np.full(300, DT),
}
LOG["z"][100::50] += 40.0


@pytest.mark.parametrize("late", [Late, LateByDifference, LateByInput, LateInMilliseconds])
def test_a_late_measurement_is_that_of_then(late: type[Kalman]) -> None:
    (result,) = boresight.check(late, LOG, levels=("fixed", "c"))["results"]
    assert result.good, result.lines()
    hand = boresight.run(ByHand, LOG, levels="float")["outputs"]
    assert np.abs(result.floating.outputs["h"] - hand["h"]).max() < 1e-9
    error = (result.fixed.outputs["h"] - LOG["h_true"])[100:]
    assert np.sqrt(np.mean(error**2)) < 0.1
    accepted, rejected = (result.fixed.outputs[n].sum() for n in ("accepted", "rejected"))
    assert (accepted, rejected) == (len(T) - 4, 4)
    assert any(f"{accepted:.0f} accepted, {rejected:.0f} rejected" in x for x in result.lines())


def test_a_delay_needs_a_time_step() -> None:
    class Unknown(Late):
        rates_hz = {}

    with pytest.raises(InputError, match="rates_hz"):
        boresight.run(Unknown, LOG, levels="float")
