"""Kalman filter of VQF for the gyro's bias: a random walk, measured in motion and at rest."""

from __future__ import annotations

from typing import Any

from boresight.model import ops
from boresight.model.algebra.covariance import Symmetric, symmetric
from boresight.model.algebra.quaternion import dot

__all__ = ["grown", "measured"]

_GAIN_MOST = 2.0  #: bound of sqrt(P_jj r P r^T) w over S.


def grown(p: Symmetric, start: float, growth: float, most: float) -> Symmetric:
    """P + V on the variances below their start value."""
    return symmetric(
        3,
        lambda i, j: (
            ops.bounded(
                p[i][i] + ops.where(p[i][i] < start, growth, 0.0), 0.0, most, "start and one growth"
            )
            if i == j
            else p[i][j]
        ),
    )


def measured(
    p: Symmetric,
    rows: list[list[Any]],
    errors: list[Any],
    weights: list[Any],
    most: float,
    anew: tuple[Any, float],
) -> tuple[list[Any], Symmetric]:
    """Change of the bias, and P after the measurement: K e, P - K R P.

    Errors of the three components are independent, so they are taken one after the other, without
    inverting a matrix; e_i is that before any of them::

        c = P r_i    S = 1 + w_i r_i c    k = (w_i/S) c
        d <- d + k (e_i - r_i d)    P <- P - k c^T

    Parameters
    ----------
    p
        In units of a measurement variance, variances of at most ``most``.
    rows
        R; each row is of about unit length at most.
    errors
        e = y - R b.
    weights
        That variance over those of the components, 0 to 1; 0: no measurement.
    anew : (condition, float)
        Where it holds, P is diagonal with this variance instead.
    """
    change: list[Any] = [0.0] * 3
    for k, (row, error, weight) in enumerate(zip(rows, errors, weights, strict=True)):
        column = [
            ops.bounded(dot(row, p[j]), -2.0 * most, 2.0 * most, "sqrt(P_jj r P r^T)")
            for j in range(3)
        ]
        along = ops.bounded(dot(row, column), 0.0, 4.0 * most, "variance along r")
        total = ops.bounded(1.0 + weight * along, 1.0, 1.0 + 4.0 * most, "S")
        share = ops.bounded(weight / total, 0.0, 1.0, "w/S")
        gain = [ops.bounded(c * share, -_GAIN_MOST, _GAIN_MOST, "gain") for c in column]
        move = ops.saturated(error - dot(row, change), 4.0)
        change = [ops.saturated(d + g * move, 4.0) for d, g in zip(change, gain, strict=True)]
        p = _reduced(p, gain, column, most, anew if k == 2 else None)
    return change, p


def _reduced(
    p: Symmetric, gain: list[Any], column: list[Any], most: float, anew: tuple[Any, float] | None
) -> Symmetric:
    """P - k c^T, or a diagonal start."""

    def element(i: int, j: int) -> Any:
        value = p[i][j] - gain[i] * column[j]
        if anew is not None:
            value = ops.where(anew[0], anew[1] if i == j else 0.0, value)
        return ops.bounded(value, 0.0 if i == j else -most, most, "covariance")

    return symmetric(3, element)
