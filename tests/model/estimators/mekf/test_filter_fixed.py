"""The flagship filter in fixed point: as float, no saturation, P positive at legal extremes."""

from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.estimator import input_words, param_words
from boresight.model.estimators.mekf import Mekf
from boresight.model.estimators.mekf.interface import PAIRS, covariance_name
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from tests.support.compiled_float import compiled_float

STEPS = 4000
PROGRAM = Mekf().compile()


def attitude(values: Any) -> Any:
    q = np.stack([values[n] for n in ("qw", "qx", "qy", "qz")], axis=-1)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def test_fixed_equals_float_on_a_recorded_log() -> None:
    """Every sample within 0.0005 deg, no saturation, every status bit the same."""
    x = feed(Mekf(), read_record(bundled("ximu_walk"))).inputs[:STEPS]
    out, saturated = CModel(PROGRAM).update(input_words(PROGRAM, x[:, :, None])[:, :, 0])
    fixed = {
        name: PROGRAM.format(n).real(out[:, k])
        for k, (name, n) in enumerate(zip(PROGRAM.output_names, PROGRAM.outputs, strict=True))
    }
    floats = {k: v[:, 0] for k, v in compiled_float(Mekf(), x[:, :, None])[0].items()}
    chord = np.linalg.norm(attitude(fixed) - attitude(floats), axis=1)
    error = np.degrees(
        2.0 * np.minimum(chord, np.linalg.norm(attitude(fixed) + attitude(floats), axis=1))
    )
    assert 1e-7 < error.max() < 5e-4
    assert not saturated.any()
    assert np.array_equal(fixed["status"], floats["status"])
    for name in ("pitch", "roll", "heading"):
        d = np.abs((fixed[name] - floats[name] + 1.0) % 2.0 - 1.0) * 180.0
        assert np.quantile(d, 0.99) < 1e-3


def _motion(rng: np.random.Generator, steps: int, dt: float) -> Any:
    t = dt * np.arange(steps)[:, None]
    rate = 3.0 * np.sin(t * [1.3, 2.1, 0.7] + [0.0, 1.0, 2.0]) + rng.normal(0.0, 0.01, (steps, 3))
    field = rng.normal(0.0, 1.0, (steps, 3)) + [0.0, 18.0, -40.0]
    force = rng.normal(0.0, 1.0, (steps, 3)) + [0.0, 0.0, 9.8]
    return np.concatenate([np.full((steps, 1), dt), rate, field, force], axis=1)


def _inputs() -> dict[str, Any]:
    rng = np.random.default_rng(3)
    full = np.stack([rng.uniform(i.low, i.high, 3000) for i in Mekf.inputs], axis=1)
    full[:, 0] = np.abs(full[:, 0])
    return {"slow": _motion(rng, 3000, 0.02), "quick": _motion(rng, 6000, 0.0005), "full": full}


def _cases() -> list[dict[str, float]]:
    rng = np.random.default_rng(4)
    single = [{q.name: v} for q in Mekf.params for v in (q.low, q.high)]
    mixed = [{q.name: float(rng.choice([q.low, q.high])) for q in Mekf.params} for _ in range(25)]
    return [{}, *single, *mixed]


@pytest.mark.parametrize("kind", ["slow", "quick", "full"])
def test_p_stays_positive_and_nothing_saturates_at_legal_extremes(kind: str) -> None:
    model = CModel(PROGRAM)
    x = _inputs()[kind]
    words = input_words(PROGRAM, x[:, :, None])[:, :, 0]
    names = [s.name for s in Mekf.states]
    at = {n: k for k, n in enumerate(names)}
    lsb = PROGRAM.format(PROGRAM.states[names.index("p_ee")][0]).lsb
    for case in _cases():
        model.reset()
        for number, word in param_words(PROGRAM, Mekf().param_values(case)).items():
            model.set_param(PROGRAM.values[number].name, word)
        _, saturated, states = model.trajectory(words)
        assert not saturated.any(), case
        p = np.zeros((len(states), 6, 6))
        for i, j in PAIRS:
            p[:, i, j] = p[:, j, i] = states[:, at[covariance_name(i, j)]] * lsb
        variance = np.einsum("nii->ni", p)
        assert variance.min() > 0.0, case
        sd = np.sqrt(variance[::50])
        correlation = p[::50] / sd[:, :, None] / sd[:, None, :]
        assert np.linalg.eigvalsh(correlation).min() > 1e-4, case
