"""How VQF turns: vectors to navigation axes, the attitude to the vertical."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from boresight.model import ops
from boresight.model.algebra.quaternion import NOT_UNIT, cross, dot
from boresight.model.attitude.vqf.settings import FORCE_MOST

_UPSIDE_DOWN = 0.5  #: 1 + cosine of a turn from which on half a turn comes first.


def rotated(q: list[Any], v: Any) -> list[Any]:
    """C v of a unit quaternion (w, r): v + 2 (w t + r x t) with t = r x v. 21 slots."""
    _, x, y, z = q
    t = [ops.bounded(c, -FORCE_MOST, FORCE_MOST, "a vector") for c in cross((x, y, z), v)]
    around = (y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0])
    return [
        ops.bounded(
            a + 2.0 * (q[0] * b + c), -FORCE_MOST, FORCE_MOST, "a turned vector", unless=NOT_UNIT
        )
        for a, b, c in zip(v, t, around, strict=True)
    ]


def made_vertical(
    q: list[Any], e: Any, n: Any, u: Any
) -> tuple[list[Any], Callable[[Any], tuple[Any, Any, Any]]]:
    """Attitude after the shortest turn of a unit vector (e, n, u) to the vertical, and that turn.

    The turn is the quaternion (1 + u, n, -e, 0)/2 over its length, the root of (1 + u)/2. Near half
    a turn that length is lost in rounding, so half a turn about x comes first, and then the
    shortest turn of (e, -n, -u). Of unit q the product has the length of the quaternion too. Its
    matrix, which turns vectors::

        M = [[1 - e^2/(1 + u), -e n/(1 + u), -e], [..., 1 - n^2/(1 + u), -n], [e, n, u]]
    """
    inverted = 1.0 + u < _UPSIDE_DOWN
    w, x, y, z = q
    w, x = ops.where(inverted, -x, w), ops.where(inverted, w, x)
    y, z = ops.where(inverted, -z, y), ops.where(inverted, y, z)
    n, u = ops.flip(inverted, n), ops.flip(inverted, u)
    s = ops.named("one_and_up", 1.0 + u)
    turned = [
        0.5 * (s * w) - 0.5 * (n * x) + 0.5 * (e * y),
        0.5 * (s * x) + 0.5 * (n * w) - 0.5 * (e * z),
        0.5 * (s * y) - 0.5 * (n * z) - 0.5 * (e * w),
        0.5 * (s * z) + 0.5 * (n * y) + 0.5 * (e * x),
    ]
    turned = [ops.saturated(c, 1.0) for c in turned]
    norm_sq = ops.bounded(
        dot(turned, turned), 0.0, 1.0, "norms of at most one", unless="rounding made them longer"
    )
    inverse = ops.rsqrt(norm_sq)
    a, b = (ops.bounded(c * inverse, -2.01, 2.01, "twice the sine of half a turn") for c in (n, e))
    across = ops.bounded(-0.5 * (a * b), -1.0, 1.0, "of a matrix", unless=NOT_UNIT)
    first, second = (
        ops.bounded(1.0 - 0.5 * (c * c), -1.0, 1.0, "of a matrix", unless=NOT_UNIT) for c in (b, a)
    )

    def turn(v: Any) -> tuple[Any, Any, Any]:
        v = (v[0], ops.flip(inverted, v[1]), ops.flip(inverted, v[2]))
        return (
            first * v[0] + across * v[1] - e * v[2],
            across * v[0] + second * v[1] - n * v[2],
            e * v[0] + n * v[1] + u * v[2],
        )

    return [ops.saturated(c * inverse, 1.0) for c in turned], turn
