"""P stays positive in the integers: on hostile input, from small and large values, with a gate."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.kalman import Kalman, Measurement, State
from boresight.model.declarations import Input, Output, Param
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.fit.observe import hostile
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted
from tests.support.pages import ROOT

FILTERS = {
    f"{ROOT}/examples/kalman.py": 20_000,
    f"{ROOT}/examples/pendulum.py": 20_000,
    "battery": 20_000,
    "ekf2": 4_000,
    "ins_gnss": 6_000,
    "pmsm": 20_000,
    "ekf_quaternion": 20_000,
    "ekf_bias": 20_000,
    "mekf": 20_000,
}
#: Least eigenvalue that rounding explains, in last bits of the covariance's words.
LEAST = -4.0


#: Initial variances of an attitude, rad^2.
P0 = (1e-8, 1e-6, 1e-4, 1e-2, 1.0)
#: Share of their default of other initial variances; of initial deviations the roots.
SHARES = (1e-4, 1e-2, 1.0, 1e2, 1e4)


def initial_covariances(estimator: Estimator) -> list[dict[str, float]]:
    """Parameter sets of several initial covariances, of the parameters named ``p0_...``.

    Angles, in rad and rad^2, take each of `P0`, or its root. Where none is an angle, all take
    `SHARES` of their default, within their range; one empty set where there is none.
    """
    found = [p for p in estimator.params if p.name.startswith("p0_")]
    angles = [p for p in found if p.unit in ("rad", "rad^2")]

    def value(p: Param, p0: float, share: float) -> float:
        power = 1.0 if p.unit.endswith("^2") else 0.5
        wanted = float(p0**power if angles else share**power * p.default)
        return min(max(wanted, p.low), p.high)

    sets = zip(P0, SHARES, strict=True) if found else [(0.0, 0.0)]
    return [{p.name: value(p, *of) for p in angles or found} for of in sets]


def stays_positive(name: str, updates: int, steps: int) -> None:
    filter = estimator_of(name)
    level, covariance = Emitted(Build(filter)), covariance_of(filter)
    stimuli = hostile(filter, steps, np.random.default_rng(1))
    params = initial_covariances(filter)
    for values in params:
        for stimulus, inputs in stimuli.items():
            level.set_params(values)
            level.reset()
            for _ in range(max(1, updates // (len(params) * len(stimuli) * steps))):
                states = level.run(inputs).states
                assert states is not None
                p = covariance.of_words(level.program, states)
                where = f"{name}, {stimulus}, {values}"
                assert (np.diagonal(p, axis1=1, axis2=2) >= 0.0).all(), where
                assert np.linalg.eigvalsh(p[::50]).min() >= LEAST, where


@pytest.mark.parametrize("name", FILTERS)
def test_hostile_inputs(name: str) -> None:
    stays_positive(name, FILTERS[name], 1000)


@pytest.mark.soak
@pytest.mark.parametrize("name", FILTERS)
def test_ten_million_hostile_inputs(name: str) -> None:
    stays_positive(name, 10_000_000, 20_000)


class Clock(Kalman):
    """An oscillator and its rate, whose first variances are 1e5 times that of a measurement."""

    inputs = (Input("z", -1e4, 1e4),)
    params = (Param("r", 100.0, 1.0, 1e4),)
    states = (State("phase", -2e4, 2e4, sd=1e3, sd_max=2e3), State("rate", -500.0, 500.0, sd=100.0))
    outputs = (Output("phase", tolerance=1.0),)
    gate: float | None = None

    def f(self, x, u, p):
        return {"phase": x.phase + x.rate}

    def noise(self, x, u, p):
        return {"phase": 1.0, "rate": 0.01}

    def measure(self, x, u, p):
        return [Measurement(u.z, x.phase, p.r, gate=self.gate)]


def test_a_gate_that_is_open_costs_no_accuracy() -> None:
    """The factor of a reduction of P is as exact with a gate as without."""
    z = 300.0 + np.random.default_rng(1).normal(0.0, 10.0, (400, 1))
    errors = []
    for gate in (None, 30.0):
        build = Build(type("Clock", (Clock,), {"gate": gate})(), word=26)
        fixed, floating = (kind(build).run(z).outputs["phase"] for kind in (Emitted, CompiledFloat))
        errors.append(np.abs(fixed - floating).max())
    assert max(errors) < 0.5, errors
