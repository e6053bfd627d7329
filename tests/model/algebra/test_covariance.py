"""Covariances and scalar updates."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.model.algebra.covariance import (
    BELOW_ONE,
    congruence,
    covariance_of,
    covariance_states,
    downdated,
    drifted,
    element_names,
    partly_turned,
    reduced,
    sheared,
    symmetric,
    updated_column,
)
from boresight.model.algebra.scalar_update import MOVE_LIMIT, Measured, kept, lowered, updated
from boresight.model.lowering.trace import Scalar, Trace, Tracer

# -- covariance algebra on scalars against numpy, and what it costs -------------------------------

RNG = np.random.default_rng(4)


def positive(n: int) -> Any:
    root = RNG.normal(size=(n, n))
    p = root @ root.T
    return p / np.trace(p)


def listed(p: Any) -> Any:
    return symmetric(len(p), lambda i, j: p[i, j])


def test_states_hold_the_upper_half_and_come_back_as_a_matrix() -> None:
    states = covariance_states(3, lambda i: 0.1 * (i + 1))
    assert [s.name for s in states] == ["p00", "p01", "p02", "p11", "p12", "p22"]
    assert [s.initial for s in states] == [0.1, 0.0, 0.0, 0.2, 0.0, pytest.approx(0.3)]
    assert all((s.low == 0.0) == (s.name[1] == s.name[2]) and s.high == BELOW_ONE for s in states)
    p = covariance_of(SimpleNamespace(**{s.name: s.name for s in states}), 3)
    assert p[2][1] == "p12" == p[1][2]
    assert element_names(2, "c") == [("c00", 0, 0), ("c01", 0, 1), ("c11", 1, 1)]


@pytest.mark.parametrize("n", [3, 4])
def test_congruence(n: int) -> None:
    p, m = positive(n), RNG.normal(size=(n, n))
    result = congruence(m, listed(p), lambda i, j, value: value)
    assert np.allclose(result, m.T @ p @ m, atol=1e-14)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4])
def test_downdate_and_single_columns_of_it(count: int) -> None:
    p, gains = positive(4), [list(0.1 * RNG.normal(size=4)) for _ in range(count)]
    want = p - sum((np.outer(g, g) for g in gains), np.zeros((4, 4)))
    for c in range(4):
        assert np.allclose(updated_column(listed(p), c, gains), want[:, c], atol=1e-15)
    assert np.allclose(np.array(downdated(listed(p), gains, False), float), want, atol=1e-15)
    assert np.array_equal(np.array(downdated(listed(p), gains, True), float), p)
    if count == 1:
        assert np.allclose(np.array(reduced(listed(p), gains[0]), float), want, atol=1e-15)


def test_optimal_gains_never_take_more_than_there_is() -> None:
    """P - L L^T with L = P H / sqrt(H P H + R) stays positive for the least R."""
    p = positive(4)
    for h in np.eye(4):
        gain = p @ h / np.sqrt(h @ p @ h + 1e-12)
        p = np.array(downdated(listed(p), [list(gain)], False), float)
    assert np.linalg.eigvalsh(p).min() > -1e-15


def test_a_skipped_downdate_costs_nothing_more() -> None:
    """Terms under a flag: one slot per product and one per element, in one group each."""
    from boresight.model.lowering.lower import lower
    from boresight.model.words.fixed import Arithmetic

    slots = []
    for skip in (False, True):
        g = Tracer("test")
        leaves: list[Scalar] = [g.leaf("input", f"x{k}", -0.5, 0.5) for k in range(10)]
        p = symmetric(2, lambda i, j, v=leaves: v[i + j])
        gains = [leaves[4:6], leaves[6:8]]
        done = downdated(p, gains, leaves[9] < 0.0 if skip else leaves[9] < -1.0)
        program = lower(
            Trace(g, leaves, {f"p{i}{j}": done[i][j] for _, i, j in element_names(2)}),
            Arithmetic(word=32),
        )[0]
        slots.append(sum(len(op.terms) for op in program.ops))
    assert slots[0] == slots[1]


def test_turn_of_the_leading_states() -> None:
    p, m = positive(5), np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    whole = np.eye(5)
    whole[:3, :3] = m
    values = np.array(partly_turned(m.tolist(), listed(p), lambda i, j, v: v))
    assert values == pytest.approx(whole.T @ p @ whole, abs=1e-15)


def test_drift_of_three_rotations() -> None:
    p, g = positive(6), 0.01 * RNG.normal(size=(3, 3))
    phi = np.eye(6)
    phi[:3, 3:] = -g
    values = np.array(drifted(listed(p), g.tolist(), 1e-4, 1e-5))
    wanted = phi @ p @ phi.T + np.diag([1e-4] * 3 + [1e-5] * 3)
    assert values == pytest.approx(wanted, abs=1e-15)


def test_sheared_is_the_congruence() -> None:
    p = positive(6)
    phi = np.eye(6)
    rows = {1: {0: 0.3, 4: -0.2}, 3: {2: 0.1, 4: 0.5, 5: -0.4}}
    for i, row in rows.items():
        for j, value in row.items():
            phi[i, j] = value
    assert np.array(sheared(listed(p), rows)) == pytest.approx(phi @ p @ phi.T)


def test_names_of_more_than_ten_states() -> None:
    names = element_names(13)
    assert len({name for name, _, _ in names}) == len(names) == 91
    assert ("pac", 10, 12) in names and ("p09", 0, 9) in names
    x = SimpleNamespace(**{name: float(16 * i + j) for name, i, j in names})
    assert covariance_of(x, 13)[12][10] == 16 * 10 + 12


# -- one update against the matrix form; gate; rows of zeros; what is kept and added --------------

SCALAR_UPDATE_RNG = np.random.default_rng(2)
ROOT = 0.3 * SCALAR_UPDATE_RNG.normal(size=(4, 4))
P = ROOT @ ROOT.T
ROW = {0: 0.5, 2: -0.7}
H = np.array([0.5, 0.0, -0.7, 0.0])


def matrix(p: Any) -> Any:
    return np.array(p, dtype=float)


def test_is_joseph() -> None:
    r, z = 0.04, 0.3
    result = updated(P, Measured(ROW, z, r), MOVE_LIMIT)
    k = P @ H / (H @ P @ H + r)
    assert matrix(result.gain) * result.move == pytest.approx(k * z)
    a = np.eye(4) - np.outer(k, H)
    joseph = a @ P @ a.T + r * np.outer(k, k)
    after = lowered(P, result, [0.0] * 4)
    assert matrix(after) == pytest.approx(joseph)


@pytest.mark.parametrize("z", [0.29, -0.31, 0.31])
def test_the_gate_is_in_deviations(z: float) -> None:
    s = float(H @ P @ H) + 0.04
    result = updated(P, Measured(ROW, z, 0.04), 0.3 / np.sqrt(s))
    beyond = abs(z) > 0.3
    assert bool(result.beyond) == beyond
    assert (result.move == 0.0) == beyond == (not matrix(result.gain).any())


def test_zeros_measure_nothing() -> None:
    result = updated(P, Measured({0: 0.0, 2: 0.0}, 0.5, 0.04), MOVE_LIMIT)
    assert not matrix(result.gain).any()
    assert matrix(lowered(P, result, [0.0] * 4)) == pytest.approx(P)


def test_forgets_and_grows() -> None:
    p = kept(listed(P), lambda i, j: not {i, j} & {3})
    left = P.copy()
    left[3, :] = left[:, 3] = 0.0
    assert matrix(p) == pytest.approx(left)
    result = updated(p, Measured({0: 0.5, 3: 1.0}, 0.0, 0.04), MOVE_LIMIT)
    after = matrix(lowered(p, result, [0.1, 0.2, 0.3, 0.4]))
    h = np.array([0.5, 0.0, 0.0, 1.0])
    column = left @ h
    wanted = left - np.outer(column, column) / (h @ column + 0.04)
    assert after == pytest.approx(wanted + np.diag([0.1, 0.2, 0.3, 0.4]))
