"""Covariance of the six errors: one scalar update, then the prediction, in one pass."""

from __future__ import annotations

from typing import Any

from boresight.model import ops
from boresight.model.algebra.covariance import Symmetric, symmetric
from boresight.model.algebra.quaternion import dot
from boresight.model.attitude.mekf.interface import BIAS_SCALE

TRACE_LIMIT = 1.6  #: rad^2 and scaled bias^2, trace of P from which on it grows no more.
GROWTH_LIMIT = 0.125  #: largest growth of a variance in one prediction.
P0_TILT, P0_HEADING = 0.07, 0.05  #: rad^2, variances of the first attitude.


def element(value: Any) -> Any:
    """An element of P, or of a row of it that was scaled down."""
    return ops.bounded(value, -1.95, 1.95, "element of P, of limited trace")


def predicted(
    P: Symmetric,
    gain: Any,
    column: Any,
    C: Any,
    step: Any,
    starts: tuple[Any, Any],
    keep: Any,
    rest_gain: Any,
    attitude: Any,
    growth: Any,
    p: Any,
) -> Symmetric:
    """Update, then predict: Phi (P - K P_h:) Phi^T + Q, Phi = [I, -A; 0, I], A = C step.

    P0 of the attitude, and of the bias, where ``starts``. No growth while the trace is beyond
    `TRACE_LIMIT`, which is more than three biases of the largest p0_bias, so that measurements
    always end that.

    Parameters
    ----------
    P, gain, column
        (6, 6), K (6,) and the row P_h: (6,) of the axis measured, biases times `BIAS_SCALE`.
    C, step
        Attitude (3, 3); time since the last update [s].
    keep, rest_gain
        1 - k and k: share of the bias that a gyro at rest leaves and gives.
    attitude, growth
        Random walk of the attitude [rad^2/s], and what youth adds to it.
    p
        Parameters bias_var, rest_var, p0_bias.
    """
    trace = P[0][0] + P[1][1] + P[2][2] + P[3][3] + P[4][4] + P[5][5]
    step = ops.named("growth_step", ops.where(trace > TRACE_LIMIT, 0.0, step))
    A = [[c * (step * (1.0 / BIAS_SCALE)) for c in row] for row in C]
    added = ops.saturated(attitude * step + growth * step, GROWTH_LIMIT)
    walk = BIAS_SCALE * BIAS_SCALE * (p.bias_var * step + p.rest_var * rest_gain)
    p0 = (P0_TILT, P0_TILT, P0_HEADING, *(BIAS_SCALE * BIAS_SCALE * p.p0_bias,) * 3)
    factor = (1.0, keep, ops.named("rest_keep_sq", keep * keep))

    def updated(i: int, j: int) -> Any:
        return P[i][j] * factor[(i > 2) + (j > 2)] - gain[i] * column[j]

    # P_bb' = P_bb + Q_b, P_tb' = P_tb - A P_bb', P_tt' = P_tt - A P_tb'^T - P_tb' A^T + Q_t:
    # the last is more by A P_bb' A^T, some 1e-9 rad^2, than the exact product, and so positive.
    bias = symmetric(
        3,
        lambda i, j: element(
            ops.where(
                starts[1],
                p0[3 + i] if i == j else 0.0,
                updated(3 + i, 3 + j) + (walk if i == j else 0.0),
            )
        ),
    )
    across = [
        [
            element(ops.where(starts[0], 0.0, updated(i, 3 + k) - dot(A[i], bias[k])))
            for k in range(3)
        ]
        for i in range(3)
    ]

    def tilt(i: int, j: int) -> Any:
        if i == j:
            value = updated(i, i) - 2.0 * dot(A[i], across[i]) + added
        else:
            value = updated(i, j) - dot(A[i], across[j]) - dot(across[i], A[j])
        return element(ops.where(starts[0], p0[i] if i == j else 0.0, value))

    top = symmetric(3, tilt)
    return [[*top[i], *across[i]] for i in range(3)] + [
        [*(across[i][k] for i in range(3)), *bias[k]] for k in range(3)
    ]
