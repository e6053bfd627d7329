"""Covariances and scalar updates."""

from typing import Any

import numpy as np
import pytest

from boresight.model.algebra.covariance import downdated, element_names, symmetric
from boresight.model.algebra.scalar_update import MOVE_LIMIT, Measured, kept, lowered, updated
from boresight.model.lowering.trace import Scalar, Trace, Tracer

# -- what a skipped downdate costs ----------------------------------------------------------------


def listed(p: Any) -> Any:
    return symmetric(len(p), lambda i, j: p[i, j])


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
