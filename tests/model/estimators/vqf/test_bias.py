"""The bias's Kalman filter is the textbook's, with a matrix inverse."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.model.algebra.covariance import symmetric
from boresight.model.estimators.vqf.bias import bias_of, grown, measured
from boresight.model.estimators.vqf.settings import CLIP_RAD_S, Settings


def lists(m: Any) -> Any:
    return symmetric(3, lambda i, j: float(m[i, j]))


@pytest.fixture
def drawn() -> tuple[Any, ...]:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3))
    p = 0.05 * root @ root.T
    r = np.linalg.qr(rng.normal(size=(3, 3)))[0] * 0.8
    return p, r, rng.uniform(-1.0, 1.0, 3), np.array([1.0, 0.3, 1e-3])


def test_one_component_after_the_other_is_all_at_once(drawn: tuple[Any, ...]) -> None:
    p, r, e, w = drawn
    most = float(p.max())
    change, after = measured(lists(p), r.tolist(), e.tolist(), w.tolist(), most, (False, 9.0))
    K = p @ r.T @ np.linalg.inv(np.diag(1.0 / w) + r @ p @ r.T)
    assert np.array(change) == pytest.approx(K @ e, abs=1e-14)
    assert np.array(after) == pytest.approx(p - K @ r @ p, abs=1e-14)
    _, anew = measured(lists(p), r.tolist(), e.tolist(), w.tolist(), most, (True, 9.0))
    assert np.array(anew).tolist() == np.diag([9.0] * 3).tolist()


def test_without_weight_nothing_is_measured(drawn: tuple[Any, ...]) -> None:
    p, r, e, _ = drawn
    change, after = measured(lists(p), r.tolist(), e.tolist(), [0.0] * 3, 1.0, (False, 9.0))
    assert np.array(change).tolist() == [0.0] * 3 and np.array(after) == pytest.approx(p)


def test_variances_grow_up_to_their_start() -> None:
    p = np.array([[0.1, 0.02, 0.0], [0.02, 0.2, 0.0], [0.0, 0.0, 0.3]])
    after = np.array(grown(lists(p), 0.2, 0.01, 0.21))
    assert after == pytest.approx(p + np.diag([0.01, 0.0, 0.0]))


def _state(settings: Settings, bias: list[float]) -> Any:
    """At rest in the low-passes: C is one, C b the bias; P at its start."""
    held = dict.fromkeys((f"p{i}{j}" for i in range(3) for j in range(i, 3)), 0.0)
    held |= {f"p{i}{i}": settings.start_variance for i in range(3)}
    b, _, a2 = settings.vertical.coefficients
    for i, row in enumerate("enu"):
        for j, column in enumerate("xyz"):
            held[f"c_z_{row}{column}"] = (1.0 - b) * (i == j)
            held[f"c_v_{row}{column}"] = (1.0 - a2) * (i == j)
        held |= {f"b_z_{row}": (1.0 - b) * bias[i], f"b_v_{row}": (1.0 - a2) * bias[i]}
    return SimpleNamespace(**held)


@pytest.mark.parametrize("resting", [True, False])
def test_what_is_measured(resting: bool) -> None:
    """At rest the mean rate; in motion, level, (-n, e)/Ts of the correction."""
    settings = Settings(50.0, 50.0)
    bias, rate = [0.1, -0.2, 0.05], [0.5 * CLIP_RAD_S, 0.25 * CLIP_RAD_S, -CLIP_RAD_S]
    turn = (2e-5, 1e-5)
    weights = settings.vertical.weights(False, 0.01)
    learnt, P, _ = bias_of(
        _state(settings, bias),
        False,
        weights,
        np.eye(3).tolist(),
        bias,
        turn,
        rate,
        resting,
        settings,
    )
    if resting:
        error = np.array([0.5, 0.25, -1.0]) - bias
        w = np.ones(3)
    else:
        error = np.array([-50.0 * turn[1] / CLIP_RAD_S, 50.0 * turn[0] / CLIP_RAD_S, -bias[2]])
        w = settings.motion_weight * np.array([1.0, 1.0, 1e-4])
    p = settings.start_variance
    gain = p / (p + 1.0 / w)
    assert np.array(learnt) == pytest.approx(bias + gain * np.clip(error, -1.0, 1.0), abs=1e-9)
    assert np.diagonal(P) == pytest.approx(p * (1.0 - gain), rel=1e-9)
