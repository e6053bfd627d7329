"""Parts of quaternion Kalman filters: states, scales, prediction, correction, status word.

The quaternion q (body to navigation) has additive errors e; P, of order four and more, is kept in
the basis of the quaternion (`model.attitude.ekf_quaternion`, `model.attitude.ekf_bias`)
and stored times the square of the parameter ``scale`` (`docs/systems/ekf.md`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import euler_ht
from boresight.model.algebra.covariance import NO_COVARIANCE, Symmetric, part
from boresight.model.algebra.quaternion import dot, increment, multiply
from boresight.model.errors import require
from boresight.model.estimator import Param, State
from boresight.model.words.rounded import sum_of as sum_of

#: Quaternion before the first alignment: less than half a turn from common attitudes.
START = (0.53770571, 0.31260333, -0.28710306, 0.72850776)
STEP_LIMIT = 0.125  #: largest process noise of one step, standard deviation times scale.
TRACE_LIMIT = 0.5  #: scaled covariance of the rotation above which it does not grow.
QUATERNION_LIMIT = 0.75  #: the same of rotation and norm.
P0_LIMIT = 0.5  #: largest initial standard deviation times scale / 2.
P0_MOST = 0.25 - 2.0**-14  #: largest initial variance: that of norm and rotation is below one.
FLOOR_NOISE = 2.0**-28  #: added to scaled variances each step, below the limit: 8 LSB at W = 32.
MOVE_LIMIT = 128.0  #: largest innovation over its scaled standard deviation.
ALIGN_NOISE = 2.0**-6  #: measurement noise while aligning, scaled.
ALIGN_P = 0.15  #: variances of the attitude while aligning, scaled; their sum is below both limits.

_SCALE = (
    "covariances are held times its square; no result but for rounding depends on it. Large keeps "
    "small covariances exact; a measurement noise (standard deviation) times it counts as at most "
    "8, p0_sd times it as at most 1"
)
SCALE = Param("scale", 8.0, 1.0, 1024.0, "", _SCALE)
_P0 = "initial standard deviation of the attitude, root of P0: large follows the first "
P0 = Param("p0_sd", 0.1, 1e-4, 1.0, "rad", _P0 + "measurements, small the alignment")


def attitude_states() -> tuple[State, ...]:
    """The quaternion."""
    pairs = zip("wxyz", START, strict=True)
    return tuple(State(f"q{axis}", -1.0, 1.0 - 2.0**-31, "", start) for axis, start in pairs)


def require_unclamped(
    values: Mapping[str, float],
    limits: Mapping[str, float],
    beside: Mapping[str, str] | None = None,
) -> None:
    """Refuse parameters that a filter would clamp at its ``scale``.

    ``limits``: largest product of a parameter and ``scale``; ``beside``: what else counts.

    InputError: a value is too large for ``scale``.
    """
    scale = values["scale"]
    for name, limit in limits.items():
        wanted = f"at most {limit / scale:.4g} at a scale of {scale:g}"
        wanted += (beside or {}).get(name, "")
        fix, good = "choose a smaller value or a smaller scale", values[name] * scale <= limit
        require(good, f"parameter {name}", wanted, values[name], fix)


# -- prediction -----------------------------------------------------------------------------------


def predicted_attitude(x: Any, half: list[Any]) -> tuple[list[Any], list[Any]]:
    """(q dq, dq) for the turn by 2 ``half`` [rad]."""
    dq = increment([ops.saturated(h, 1.0) for h in half], short=True)
    return [ops.saturated(c, 1.0) for c in multiply((x.qw, x.qx, x.qy, x.qz), dq)], dq


def is_full(a: Symmetric) -> Any:
    """Whether the trace of norm and rotation is at its limit, where nothing is added to it."""
    return sum_of(a[k][k] for k in range(4)) >= QUATERNION_LIMIT


def initial_variance(p: Any) -> Any:
    """P0, of norm and rotation."""
    p0 = ops.saturated(0.5 * p.p0_sd * p.scale, P0_LIMIT)
    return ops.bounded(ops.minimum(p0 * p0, P0_MOST), 0.0, P0_MOST, "held")


# -- correction -----------------------------------------------------------------------------------


def update(
    gains: list[list[Any]],
    moves: list[Any],
    column: list[Any],
    s: Any,
    nu: Any,
    largest: float = 17.0,
) -> None:
    """Append a scalar update: L = P H / sqrt(S) to ``gains``, nu / sqrt(S) to ``moves``.

    ``column`` is P H; P decreases by L L^T, the state grows by L times the move. ``largest``: of S.
    """
    weight = ops.rsqrt(ops.bounded(s, 0.0, largest, "P + R", unless=NO_COVARIANCE))
    moves.append(ops.saturated(ops.saturated(nu, 8.0) * weight, MOVE_LIMIT))
    gains.append([part(c * weight, "root of a variance") for c in column])


def update_along(
    p: Symmetric,
    gains: list[list[Any]],
    moves: list[Any],
    row: Mapping[int, Any],
    variance: Any,
    innovation: Any,
    moving: Any = None,
    counting: Any = None,
) -> None:
    """Append an update (see `update`) by a measurement along a vector of at most unit length.

    ``row``: the nonzero components of the Jacobian, by state. ``innovation`` is that before any of
    the updates. Where ``moving`` fails the state stays; where ``counting`` fails P stays, too.
    """
    along = [part(dot(list(row.values()), [g[k] for k in row]), "component") for g in gains]
    column = []
    for i in range(len(p)):
        value = dot(list(row.values()), [p[k][i] for k in row])
        for g, c in zip(gains, along, strict=True):
            value = value - g[i] * c
        value = value if counting is None else ops.where(counting, value, 0.0)
        column.append(part(value, "covariance"))
    for move, c in zip(moves, along, strict=True):
        innovation = innovation - move * c
    innovation = innovation if moving is None else ops.where(moving, innovation, 0.0)
    s = dot(list(row.values()), [column[k] for k in row]) + variance
    update(gains, moves, column, s, innovation)


def moved(gains: list[list[Any]], moves: list[Any], k: int, limit: float = 2.0) -> Any:
    """Component k of the correction so far, sum of gain times move."""
    total: Any = 0.0
    for n, (gain, move) in enumerate(zip(gains, moves, strict=True)):
        total = total + gain[k] * move
        if n == 1:
            total = ops.saturated(total, limit)
    return total


def correction_of(parts: list[Any]) -> list[Any]:
    """A quaternion of a correction, its components limited to 2 and 1."""
    return [ops.saturated(c, 2.0 if k == 0 else 1.0) for k, c in enumerate(parts)]


def normalised(raw: list[Any], largest: float = 8.0) -> tuple[list[Any], Any]:
    """(unit quaternion, 1/norm) of a correction, or of the product with one.

    ``largest``: of the square of its norm; that of a `correction_of` by default.
    """
    shrink = ops.rsqrt(ops.bounded(dot(raw, raw), 0.0, largest, "squares of a correction"))
    return [ops.saturated(c * shrink, 1.0) for c in raw], shrink


def above_rounding(value: Any, full: Any) -> Any:
    """A variance and a word of noise, so that rounding stays below it; not where it is ``full``."""
    return value + ops.where(full, 0.0, FLOOR_NOISE)


# -- outputs --------------------------------------------------------------------------------------


def restarted(q: list[Any], u: Any) -> dict[str, Any]:
    """Next quaternion state; a sample with dt < 0 resets it, and the next one is the first."""
    pairs = zip("wxyz", START, q, strict=True)
    return {f"q{axis}": ops.where(u.dt < 0.0, start, c) for axis, start, c in pairs}


def attitude_outputs(raw: list[Any], q: list[Any], shrink: Any, status: Any) -> dict[str, Any]:
    """Outputs of an attitude filter by name; angles from the quaternion before it is normalised."""
    return named_outputs(euler_ht(raw, shrink), q, status)


def named_outputs(angles: Any, q: Any, status: Any) -> dict[str, Any]:
    """Outputs by name of pitch, roll, heading, of a quaternion and a status word."""
    pitch, roll, heading = angles
    components = {f"q{a}": c for a, c in zip("wxyz", q, strict=True)}
    return {"pitch": pitch, "roll": roll, "heading": heading, **components, "status": status}


def status_word(flags: dict[int, Any]) -> Any:
    """The status word: bit number -> condition."""
    return sum_of(ops.where(flag, float(1 << bit), 0.0) for bit, flag in flags.items())
