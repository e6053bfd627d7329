"""VQF in fixed point: as float64, every decision the same, nothing saturates at extremes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import build_core
from boresight.model.estimators.vqf import Vqf
from boresight.sim.accuracy.manoeuvres import MANOEUVRES, manoeuvre
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from tests.support.vqf_package import angle_deg, inputs_of, journey

RATE = 25.0


def attitude(outputs: Any) -> Any:
    return np.stack([outputs[f"q{a}"] for a in "wxyz"], axis=1)


@pytest.mark.parametrize("mag", ["full", "none"])
def test_as_float64(mag: str) -> None:
    made, bound = Vqf(RATE, mag=mag), 1e-3
    build = Build(made)
    records = inputs_of(made, journey(RATE))
    fixed, real = Emitted(build).run(records), CompiledFloat(build).run(records)
    off = angle_deg(attitude(fixed.outputs), attitude(real.outputs))
    assert 1e-7 < off.max() < bound
    assert np.array_equal(fixed.outputs["status"], real.outputs["status"])
    assert fixed.saturated is not None and not fixed.saturated.any()
    for name in ("pitch", "roll", "heading"):
        d = np.abs((fixed.outputs[name] - real.outputs[name] + 1.0) % 2.0 - 1.0) * 180.0
        assert np.quantile(d, 0.99) < bound


def _hostile(made: Vqf, dt: float) -> dict[str, Any]:
    rng = np.random.default_rng(3)
    full = np.stack([rng.uniform(i.low, i.high, 1500) for i in made.inputs], axis=1)
    full[:, 0] = np.where(rng.random(1500) < 0.01, -0.1, dt)
    ends = np.array([[rng.choice([i.low, i.high]) for i in made.inputs] for _ in range(150)])
    motions = {n: inputs_of(made, manoeuvre(n, 700, rng, dt)) for n in MANOEUVRES}
    return motions | {"full": full, "ends": np.repeat(ends, 10, axis=0)}


@pytest.mark.parametrize("rate_hz, mag_rate_hz", [(10.0, 1.0), (200.0, 200.0), (1000.0, 30.0)])
def test_nothing_saturates_and_the_norm_is_kept(rate_hz: float, mag_rate_hz: float) -> None:
    made = Vqf(rate_hz, mag_rate_hz)
    rng = np.random.default_rng(4)
    level = Emitted(Build(made))
    cases: list[dict[str, float]] = [{}]
    cases += [{q.name: float(rng.choice([q.low, q.high])) for q in made.params} for _ in range(8)]
    stimuli = _hostile(made, 1.0 / rate_hz)
    for case in cases:
        level.set_params(made.param_values(case))
        for name, records in stimuli.items():
            level.reset()
            run = level.run(records)
            assert run.saturated is not None and not run.saturated.any(), (case, name)
            q = attitude(run.outputs)
            assert np.abs(np.linalg.norm(q, axis=1) - 1.0).max() < 1e-6, (case, name)


@pytest.mark.parametrize("config, most", [("small", 1000), ("fast", 600)])
def test_interval(config: str, most: int) -> None:
    core = build_core(Vqf().compile(), config, restarts=1)
    assert core.schedule.interval <= most + 10
    assert len(core.program.states) <= 68
