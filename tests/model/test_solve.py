"""Inverses of covariances in words: the equation holds, and a broken claim is told."""

from __future__ import annotations

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, Output, ops
from boresight.model.errors import InputError

N = 3
RNG = np.random.default_rng(5)
#: S = A A^T + R, and right sides.
A = RNG.uniform(-1.0, 1.0, (200, N, N))
S = A @ A.transpose(0, 2, 1) + 0.5 * np.eye(N)
B = RNG.uniform(-2.0, 2.0, (200, N))
LOWER = [(i, j) for i in range(N) for j in range(i + 1)]


class Solved(Estimator):
    """X of S X = B, and the inverse, of three by three."""

    inputs = (
        *(Input(f"a{i}{j}", -1.0, 1.0) for i in range(N) for j in range(N)),
        *(Input(f"b{i}", -2.0, 2.0) for i in range(N)),
    )
    outputs = (
        *(Output(f"x{i}", tolerance=1e-6) for i in range(N)),
        *(Output(f"i{i}{j}", tolerance=1e-6) for i, j in LOWER),
    )
    least: float | None = None
    r = 0.5

    def step(self, x, u, p):
        a = np.array([[getattr(u, f"a{i}{j}") for j in range(N)] for i in range(N)])
        s = a @ a.T + self.r * np.eye(N)
        solved = ops.solve(s, np.array([u.b0, u.b1, u.b2]), self.least)
        inverse = ops.inverse(s, self.least)
        return {}, {
            **{f"x{i}": ops.bounded(v, -7.0, 7.0, "|B| / 0.5") for i, v in enumerate(solved)},
            **{f"i{i}{j}": inverse[i, j] for i, j in LOWER},
        }


class Claims(Solved):
    """Claims a least pivot that is too large."""

    least = 1.0


LOG = {f"a{i}{j}": A[:, i, j] for i in range(N) for j in range(N)}
LOG |= {f"b{i}": B[:, i] for i in range(N)}


def test_solve_and_inverse() -> None:
    (result,) = boresight.check(Solved, LOG, levels=("fixed", "c"))["results"]
    assert result.good, result.lines()
    outputs, inverse = result.fixed.outputs, np.linalg.inv(S)
    x = np.linalg.solve(S, B[:, :, None])[:, :, 0]
    assert max(np.abs(outputs[f"x{i}"] - x[:, i]).max() for i in range(N)) < 1e-6
    assert max(np.abs(outputs[f"i{i}{j}"] - inverse[:, i, j]).max() for i, j in LOWER) < 1e-6


def test_a_least_pivot_that_does_not_hold() -> None:
    assert not boresight.check(Claims, LOG, levels=("fixed",)).good


def test_a_matrix_without_a_least_pivot_is_refused() -> None:
    class Singular(Solved):
        r = 0.0

    with pytest.raises(InputError, match="least="):
        boresight.check(Singular, LOG, levels=("fixed",))
