"""The filter as its specification has it: dense matrices in float64, many runs side by side.

Four states, the innovation of all six components at once, q set back to norm one and P left alone.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from boresight.model.algebra.quaternion import left_matrix, multiply, right_matrix
from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY

#: Field [uT] and its dip [rad]; the root of Q over the time step [rad/s].
_FIELD_UT, _DIP, _Q_SD = 50.0, math.radians(54.0), 1.5 * math.radians(0.3)


def prototype(rows: FloatArray, start: FloatArray, *, p0: float, r_sd: float = 0.05) -> FloatArray:
    """Quaternions (n, runs, 4) of records (n, runs, 10) from a start (runs, 4).

    Sensors over g and the field's strength; ``r_sd`` is the root of R (very large: the gyro alone),
    ``p0`` the first P.
    """
    vectors = ((0.0, 0.0, 1.0), (math.cos(_DIP), 0.0, -math.sin(_DIP)))
    q, cov = start.copy(), np.tile(p0 * np.eye(4), (len(start), 1, 1))
    out = np.empty((*rows.shape[:2], 4))
    unit, noise = np.eye(4), r_sd**2 * np.eye(6)
    for k, row in enumerate(rows):
        step = np.abs(row[:, :1])
        f = _picard(step * row[:, 1:4])
        q = np.einsum("rij,rj->ri", f, q)
        cov = f @ cov @ f.swapaxes(1, 2) + (_Q_SD * step[0, 0]) ** 2 * unit  # (31)
        z = np.concatenate([row[:, 4:7] / GRAVITY, row[:, 7:10] / _FIELD_UT], axis=1)
        h = np.concatenate([_jacobian(q, v) for v in vectors], axis=1)  # (25)
        gain = cov @ h.swapaxes(1, 2) @ np.linalg.inv(h @ cov @ h.swapaxes(1, 2) + noise)  # (30)
        innovation = z - 0.5 * np.einsum("rij,rj->ri", h, q)
        q = q + np.einsum("rij,rj->ri", gain, innovation)
        cov = (unit - gain @ h) @ cov  # (32)
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        out[k] = q
    return out


def _picard(turn: FloatArray) -> FloatArray:
    """(19): I (1 - D^2/8) + (1/2 - D^2/48) Theta, Theta of (20); turns (runs, 3) [rad]."""
    square = (turn**2).sum(axis=1)[:, None, None]
    theta = _by_run(right_matrix([np.zeros(len(turn)), *turn.T]))
    return np.asarray((1.0 - square / 8.0) * np.eye(4) + (0.5 - square / 48.0) * theta)


def _jacobian(q: FloatArray, v: tuple[float, float, float]) -> FloatArray:
    """(25), of q* v q = C(q)^T v: 2 L(q* v) without its first row, (runs, 3, 4)."""
    w, x, y, z = q.T
    return 2.0 * _by_run(left_matrix(multiply((w, -x, -y, -z), (0.0, *v)))[1:])


def _by_run(rows: list[list[Any]]) -> FloatArray:
    return np.array(rows).transpose(2, 0, 1)
