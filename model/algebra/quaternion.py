"""Quaternion and vector algebra on lists of scalars: the same code on floats and on the tracer.

Quaternions are Hamilton, scalar first, body to navigation (`docs/conventions.md`). Where
`sim.rotations.rotation` works on whole arrays in float64, these functions build the sums of
products of an estimator's ``step``, one operation of the engine each. Docstrings give their slots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from boresight.model import ops
from boresight.model.words.rounded import sum_of

Vector = Sequence[Any]
Matrix = Sequence[Sequence[Any]]

#: When components leave the bounds of unit vectors: `model.ops.bounded`'s ``unless``.
NOT_UNIT = "its quaternion or vector is not of length one"
NO_ROTATION = "the matrix is no rotation"


def dot(a: Vector, b: Vector) -> Any:
    """a . b, one slot per component."""
    return sum_of(x * y for x, y in zip(a, b, strict=True))


def cross(a: Vector, b: Vector) -> tuple[Any, Any, Any]:
    """a x b, 6 slots."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def turn(c: Matrix, v: Vector) -> list[Any]:
    """C v, 9 slots."""
    return [dot(row, v) for row in c]


def conjugate_turn(c: Matrix, v: Vector) -> list[Any]:
    """C^T v, 9 slots."""
    return [dot([row[k] for row in c], v) for k in range(3)]


def left_matrix(q: Vector) -> list[list[Any]]:
    """L(q): q p = L(q) p, (4, 4). Its first column is q, the others are Xi(q)."""
    w, x, y, z = q
    return [[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]


def right_matrix(q: Vector) -> list[list[Any]]:
    """R(q): p q = R(q) p, (4, 4)."""
    w, x, y, z = q
    return [[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]]


def multiply(p: Vector, q: Vector) -> list[Any]:
    """p q, 16 slots."""
    return [dot(row, q) for row in left_matrix(p)]


def matrix(q: Vector, *, unit: bool = True) -> list[list[Any]]:
    """C_nb of a unit quaternion; its rows are east, north and up in body axes. 21 slots.

    ``unit``: q is known to be no longer than one. Else elements are limited to one.
    """

    def element(value: Any) -> Any:
        if not unit:
            return ops.saturated(value, 1.0)
        return ops.bounded(value, -1.0, 1.0, "rotation matrix", unless=NOT_UNIT)

    def diagonal(k: int) -> Any:
        a, b = (c for n, c in enumerate(q[1:]) if n != k)
        return 1.0 - 2.0 * a * a - 2.0 * b * b

    return _rotation(q, lambda k: element(diagonal(k)), element)


def _rotation(
    q: Vector, diagonal: Callable[[int], Any], element: Callable[[Any], Any]
) -> list[list[Any]]:
    """Rows of a rotation; ``element`` limits what is computed beside the diagonal."""
    w, x, y, z = q
    return [
        [diagonal(0), element(2.0 * x * y - 2.0 * w * z), element(2.0 * x * z + 2.0 * w * y)],
        [element(2.0 * x * y + 2.0 * w * z), diagonal(1), element(2.0 * y * z - 2.0 * w * x)],
        [element(2.0 * x * z - 2.0 * w * y), element(2.0 * y * z + 2.0 * w * x), diagonal(2)],
    ]


def product(p: Vector, q: Vector) -> list[Any]:
    """`multiply` without a negated component of its own, which would cost a slot. 16 slots."""
    return [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]


def scaled_matrix(q: Vector, largest: float = 4.0) -> list[list[Any]]:
    """|q|^2 C_nb of a quaternion whose squared norm is at most ``largest``, 30 slots."""

    def element(value: Any) -> Any:
        return ops.bounded(value, -largest, largest, "rotation matrix, scaled")

    def diagonal(k: int) -> Any:
        total = q[0] * q[0]
        for n, c in enumerate(q[1:]):
            total = total + c * c if n == k else total - c * c
        return element(total)

    return _rotation(q, diagonal, element)


def increment(half: Vector, *, short: bool = False) -> list[Any]:
    """Quaternion of the turn by 2 ``half`` [rad], three terms of each series, 13 slots.

    With y = |half|^2::

        w = 1 - y/2 + y^2/24        v = half (1 - y/6 + y^2/120)

    Its norm is one within y^3/360. Components of ``half`` lie in [-1, 1].

    ``short``: with y^2/144 in place of y^2/120 it is never longer than one, so that a covariance
    which it turns does not grow: 1 - y^4/1728 + y^5/20736 is the square of its norm. The turn is
    smaller by |half|^5/360 rad, 1e-9 rad of 0.1 rad.
    """
    y = ops.bounded(dot(half, half), 0.0, 3.0, "three squares")
    yy = y * y
    w = ops.bounded(1.0 - 0.5 * y + (1.0 / 24.0) * yy, -1.0, 1.0, "cosine")
    last = 1.0 / 144.0 if short else 1.0 / 120.0
    s = ops.bounded(1.0 - (1.0 / 6.0) * y + last * yy, 0.0, 1.0, "sine over angle")
    return [w, *(ops.bounded(s * h, -1.0, 1.0, "sine") for h in half)]


def times_vector(q: Vector, a: Vector) -> list[Any]:
    """q (0, a), 12 slots."""
    v = q[1:]
    across = [q[0] * c + e for c, e in zip(a, cross(v, a), strict=True)]
    return [-(v[0] * a[0]) - v[1] * a[1] - v[2] * a[2], *across]


def vector_times(a: Vector, q: Vector) -> list[Any]:
    """(0, a) q, 12 slots."""
    v = q[1:]
    across = [q[0] * c + e for c, e in zip(a, cross(a, v), strict=True)]
    return [-(v[0] * a[0]) - v[1] * a[1] - v[2] * a[2], *across]


def small_turn(
    q: Vector, angle: Vector, limit: float, nearly: Vector | None = None
) -> tuple[list[Any], list[Any]]:
    """(q dq, q dq - q) for the turn dq by ``angle`` [rad], 40 slots.

    The difference, to be summed, is in words of its own range and not rounded like q. The product
    is available earlier: without y^2, and with y/25.6 for y/24. With y = |angle|^2::

        dq - 1 = (-y/8 + y^2/384, angle/2 (1 - y/24 + y^2/1920))

    ``limit``: largest angle, a power of two, at most 2^-5. ``nearly`` (3,): angle for y, without a
    small correction that is available later; by default ``angle``.
    """
    near = angle if nearly is None else nearly
    # Ranges wider than needed, for words short enough for the next product.
    y = ops.bounded(dot(near, near), 0.0, 2.0**-8, "small")
    yy = ops.bounded(y * y, 0.0, 2.0**-8, "small")
    w = ops.bounded((1.0 / 384.0) * yy - 0.125 * y, -(2.0**-10), 2.0**-10, "small")
    s = ops.bounded((1.0 / 1920.0) * yy - (1.0 / 24.0) * y, -(2.0**-10), 2.0**-10, "small")
    cosine = ops.bounded(1.0 - 0.125 * y, 0.5, 1.0, "small")
    sine = ops.bounded(1.0 - (0.03125 * y + 0.0078125 * y), 0.5, 1.0, "small")
    # sqrt(3)/2 of the limit at most, of a unit quaternion
    turned = [ops.saturated(0.5 * c, limit) for c in times_vector(q, angle)]
    pairs = list(zip(q, turned, strict=True))
    return (
        [ops.saturated(c * cosine + t * sine, 1.0) for c, t in pairs],
        [ops.saturated(t + s * t + w * c, limit) for c, t in pairs],
    )


def of_half_angles(
    pitch: tuple[Any, Any], roll: tuple[Any, Any], heading: tuple[Any, Any]
) -> tuple[Any, Any, Any, Any]:
    """q = qz(heading) qx(pitch) qy(roll); of each angle sine and cosine of its half."""
    (sp, cp), (sr, cr), (sh, ch) = pitch, roll, heading
    w, x, y, z = ch * cp, ch * sp, sh * sp, sh * cp
    return w * cr - y * sr, x * cr - z * sr, w * sr + y * cr, x * sr + z * cr


def of_angles(pitch: float, roll: float, heading: float) -> list[Any]:
    """Quaternion of angles [deg], C = Rz(heading) Rx(pitch) Ry(roll)."""
    (sp, cp), (sr, cr), (sh, ch) = (ops.sincos_ht(a / 360.0) for a in (pitch, roll, heading))
    return multiply(multiply([ch, 0.0, 0.0, sh], [cp, sp, 0.0, 0.0]), [cr, 0.0, sr, 0.0])
