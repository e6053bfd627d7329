"""The flagship filter in fixed point: as float, no saturation, P positive at legal extremes."""

from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.attitude.mekf import (
    PAIRS,
    YOUTH_ENDS,
    YOUTH_LSB,
    YOUTH_START,
    Mekf,
    covariance_name,
)
from boresight.model.estimator import input_words, param_words
from boresight.sim.rotations.rotation import rotate
from tests.support.compiled_float import compiled_float

PROGRAM = Mekf().compile()


def attitude(values: Any) -> Any:
    q = np.stack([values[n] for n in ("qw", "qx", "qy", "qz")], axis=-1)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def apart_deg(fixed: Any, floats: Any) -> Any:
    """Angle between the attitudes of two runs, outputs by name."""
    a, b = attitude(fixed), attitude(floats)
    return np.degrees(2.0 * np.minimum(*(np.linalg.norm(a - s * b, axis=1) for s in (1.0, -1.0))))


def fixed_outputs(out: Any) -> dict[str, Any]:
    return {
        name: PROGRAM.format(n).real(out[:, k])
        for k, (name, n) in enumerate(zip(PROGRAM.output_names, PROGRAM.outputs, strict=True))
    }


def float_outputs(x: Any) -> dict[str, Any]:
    return {name: v[:, 0] for name, v in compiled_float(Mekf(), x[:, :, None])[0].items()}


@pytest.mark.parametrize(("field", "most_deg"), [(False, 5e-5), (True, 4e-4)])
def test_rounding_at_rest_is_not_one_sided(field: bool, most_deg: float) -> None:
    """At rest every sample rounds alike: no heading drifts, no variance is held too large.

    With a field, turns and another one follow, which show what the gains are.
    """
    rng, n, dt = np.random.default_rng(2), 10000, 0.0035
    last = slice(n * 3 // 4, None)
    t = dt * np.arange(n)[:, None]
    x = np.zeros((n, 10))
    x[:, 0] = dt
    x[:, 1:4] = rng.normal(0.0, 0.002, (n, 3)) + [0.004, -0.003, 0.005]
    x[:, 7:] = rng.normal(0.0, 0.05, (n, 3)) + [0.0, 0.0, 9.81]
    if field:
        x[:, 4:7] = rng.normal(0.0, 0.3, (n, 3)) + [0.0, 18.0, -40.0]
        x[last, 4:7] += [15.0, 0.0, 10.0]
        x[last, 1:4] += [0.2, -0.3, 1.0] * np.sin(3.0 * t[last])
    out, saturated = CModel(PROGRAM).update(input_words(PROGRAM, x[:, :, None])[:, :, 0])
    assert apart_deg(fixed_outputs(out), float_outputs(x)).max() < most_deg
    assert not saturated.any()


def test_youth_ends_as_in_float64() -> None:
    """Its words are those of the recurrence, as fine as they are: an error would last."""
    n, dt = 1000, 0.0035
    x = np.tile([dt, 0.0, 0.0, 0.0, 0.0, 18.0, -40.0, 0.0, 0.0, 9.81], (n, 1))
    _, _, states = CModel(PROGRAM).trajectory(input_words(PROGRAM, x[:, :, None])[:, :, 0])
    at = [s.name for s in Mekf.states].index("youth")
    youth = [YOUTH_START] * 2  # the heading aligns with the second sample
    for _ in range(n - 2):
        y = youth[-1]
        youth.append(y - y * min(y * dt + YOUTH_ENDS * dt, 0.5) - YOUTH_LSB)
    result = PROGRAM.format(PROGRAM.states[at][0]).real(states[:, at])
    assert result == pytest.approx(youth, rel=3e-6)


@pytest.mark.parametrize(("least", "most", "most_deg"), [(3.0, 3.0, 1e-4), (5.0, 9.0, 3e-4)])
def test_first_samples_of_weak_force_and_steep_field(
    least: float, most: float, most_deg: float
) -> None:
    """Where little is left of either the square has to keep its bits."""
    rng, n = np.random.default_rng(4), 60
    turns = rng.normal(0.0, 1.0, (n, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    away = np.radians(3.0)
    field = rotate(turns, 40.0 * np.array([np.sin(away), 0.0, -np.cos(away)]))
    x = np.concatenate([np.full((n, 1), 0.0035), np.zeros((n, 3)), field], axis=1)
    force = np.linspace(least, most, n)[:, None] * [0.0, 0.0, 1.0]
    x = np.concatenate([x, rotate(turns, force)], axis=1)
    starts = np.repeat(x.T[None], 20, axis=0)  # of each the same sample again and again
    floats, _ = compiled_float(Mekf(), starts)
    model, errors = CModel(PROGRAM), []
    for k in range(n):
        model.reset()
        out, _ = model.update(input_words(PROGRAM, starts[:, :, k, None])[:, :, 0])
        wanted = {name: v[:, k] for name, v in floats.items()}
        errors.append(apart_deg(fixed_outputs(out), wanted).max())
    assert max(errors) < most_deg


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
