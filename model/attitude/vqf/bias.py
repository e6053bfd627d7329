"""Kalman filter of VQF for the gyro's bias: a random walk, measured in motion and at rest."""

from __future__ import annotations

from typing import Any

from boresight.model import ops
from boresight.model.algebra.covariance import Symmetric, symmetric
from boresight.model.algebra.low_pass import Weights, filtered
from boresight.model.algebra.quaternion import dot
from boresight.model.attitude.vqf.settings import CLIP_RAD_S, ROOT_3, Settings

_VERTICAL_WEIGHT = 1e-4  #: of the measurement about the vertical, over that of the others.
_GAIN_MOST = 2.0  #: bound of sqrt(P_jj r P r^T) w over S.


def grown(p: Symmetric, start: float, growth: float, high: float) -> Symmetric:
    """P + V on the variances below their start value."""
    return symmetric(
        3,
        lambda i, j: (
            ops.bounded(
                p[i][i] + ops.where(p[i][i] < start, growth, 0.0), 0.0, high, "start and one growth"
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
    high: float,
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
        In units of a measurement variance, variances of at most ``high``.
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
            ops.bounded(dot(row, p[j]), -2.0 * high, 2.0 * high, "sqrt(P_jj r P r^T)")
            for j in range(3)
        ]
        along = ops.bounded(dot(row, column), 0.0, 4.0 * high, "variance along r")
        total = ops.bounded(1.0 + weight * along, 1.0, 1.0 + 4.0 * high, "S")
        share = ops.bounded(weight / total, 0.0, 1.0, "w/S")
        gain = [ops.bounded(c * share, -_GAIN_MOST, _GAIN_MOST, "gain") for c in column]
        move = ops.saturated(error - dot(row, change), 4.0)
        change = [ops.saturated(d + g * move, 4.0) for d, g in zip(change, gain, strict=True)]
        p = _reduced(p, gain, column, high, anew if k == 2 else None)
    return change, p


def _reduced(
    p: Symmetric, gain: list[Any], column: list[Any], bound: float, anew: tuple[Any, float] | None
) -> Symmetric:
    """P - k c^T, or a diagonal start."""

    def element(i: int, j: int) -> Any:
        value = p[i][j] - gain[i] * column[j]
        if anew is not None:
            value = ops.where(anew[0], anew[1] if i == j else 0.0, value)
        return ops.bounded(value, 0.0 if i == j else -bound, bound, "covariance")

    return symmetric(3, element)


def bias_of(
    x: Any,
    restart: Any,
    weights: Weights,
    C: Any,
    bias: list[Any],
    vertical: tuple[Any, Any],
    mean_rate: list[Any],
    resting: Any,
    settings: Settings,
) -> tuple[list[Any], Symmetric, dict[str, Any]]:
    """Bias and P after a sample, and the states of the low-passes of C and of C b.

    At rest the low-passed gyro is the bias. In motion the correction of the inclination in a step
    is the mean of C times the remaining bias; a weak measurement of zero about the vertical, where
    the bias is not observable, lets it forget::

        e_e = -n/Ts + mean(C b)_e - mean(C)_e b     e_n = e/Ts + mean(C b)_n - mean(C)_n b
        e_u = -mean(C)_u b

    Parameters
    ----------
    weights : Weights
        Of the low-pass of the specific force, which C and C b share.
    bias
        Before it, in units of `CLIP_RAD_S`, at which errors and bias are clipped.
    vertical
        (e, n) of the low-passed force before the correction, a unit vector.
    """
    R, means, states = _averaged(x, weights, C, bias, settings)
    east, north = vertical
    rate = settings.rate_hz / CLIP_RAD_S
    in_motion = [
        -rate * north + means[0] - dot(R[0], bias),
        rate * east + means[1] - dot(R[1], bias),
        -dot(R[2], bias),
    ]
    rows, errors = [], []
    for i in range(3):
        at_rest = (1.0 / CLIP_RAD_S) * mean_rate[i] - bias[i]
        errors.append(ops.saturated(ops.where(resting, at_rest, in_motion[i]), 1.0))
        rows.append([ops.where(resting, float(i == j), R[i][j]) for j in range(3)])
    motion = settings.motion_weight
    level = ops.named("weight", ops.where(resting, 1.0, motion))
    up_weight = ops.named("weight_up", ops.where(resting, 1.0, _VERTICAL_WEIGHT * motion))
    start, bound = settings.start_variance, settings.start_variance + settings.growth
    P = grown(symmetric(3, lambda i, j: getattr(x, f"p{i}{j}")), start, settings.growth, bound)
    change, P = measured(P, rows, errors, [level, level, up_weight], bound, (restart, start))
    learnt = [
        ops.saturated(ops.where(restart, 0.0, b + d), 1.0)
        for b, d in zip(bias, change, strict=True)
    ]
    return learnt, P, states


def _averaged(
    x: Any, weights: Weights, C: Any, bias: list[Any], settings: Settings
) -> tuple[list[list[Any]], list[Any], dict[str, Any]]:
    """Low-passed C, the level part of low-passed C b, and their states."""
    across = [ops.bounded(dot(row, bias), -ROOT_3, ROOT_3, "bias of unit size") for row in C[:2]]
    out: list[Any] = []
    states: dict[str, Any] = {}
    for kind, parts, samples, bound in (
        ("c", [f"{a}{b}" for a in "enu" for b in "xyz"], [c for row in C for c in row], 1.0),
        ("b", ["e", "n"], across, ROOT_3),
    ):
        before = [(getattr(x, f"{kind}_z_{n}"), getattr(x, f"{kind}_v_{n}")) for n in parts]
        outputs, after = filtered(weights, settings.vertical, before, samples, bound)
        out += outputs
        states |= {f"{kind}_z_{n}": s[0] for n, s in zip(parts, after, strict=True)}
        states |= {f"{kind}_v_{n}": s[1] for n, s in zip(parts, after, strict=True)}
    return [out[:3], out[3:6], out[6:9]], out[9:], states
