"""Inverse trigonometry over the full range, on scalars: the same code on floats and on the tracer.

Angles in half turns. `docs/operations.md` lists the errors of 32-bit words.
"""

from __future__ import annotations

import math
from typing import Any

from boresight.model import ops
from boresight.model.algebra.quaternion import NO_ROTATION, NOT_UNIT, Matrix, Vector


def unit_angle_ht(y: Any, x: Any, inverse: Any = 1.0) -> Any:
    """Angle of (x, y) in half turns, [-1, 1), with 1/sqrt(x^2 + y^2) = ``inverse`` known.

    As `model.ops.atan2_ht`, without computing the root.
    """
    swap = x * x < y * y
    sine = ops.absolute(ops.where(swap, x, y)) * inverse
    sine = ops.bounded(sine, 0.0, 0.7188, "smaller component of a unit vector", unless=NOT_UNIT)
    sign = ops.flip(swap, x * y)
    base = ops.where(swap, ops.flip(y < 0.0, 0.5), ops.where(x < 0.0, -1.0, 0.0))
    base = ops.bounded(base, -1.0, 0.5, "quadrant")
    return ops.wrap_ht(base + ops.flip(sign < 0.0, ops.asin_ht(sine)))


def steep_angle_ht(sine: Any, cosine: Any, steep: Any) -> Any:
    """Angle in half turns, [-1/2, 1/2], whose sine and cosine >= 0 are known.

    ``steep``: condition that the cosine is the smaller one, available before the cosine.
    """
    smaller = ops.where(steep, cosine, ops.absolute(sine))
    reason = "smaller component of a unit vector"
    smaller = ops.bounded(smaller, 0.0, 0.7188, reason, unless=NOT_UNIT)
    base = ops.where(steep, ops.flip(sine < 0.0, 0.5), 0.0)
    base = ops.bounded(base, -0.5, 0.5, "quarter")
    return ops.wrap_ht(base + ops.flip(ops.flip(steep, sine) < 0.0, ops.asin_ht(smaller)))


def asin_ht(x: Any) -> Any:
    """Half turns whose sine is ``x``, [-1/2, 1/2]; arguments are clamped to [-1, 1].

    From 1/2 on by half the angle, which preserves the bits of ``x`` near one::

        asin(x) = pi/2 - 2 asin(sqrt((1 - x)/2))
    """
    size = ops.minimum(ops.absolute(x), 1.0)
    large = size > 0.5
    square = ops.bounded(0.5 - 0.5 * size, 0.0, 0.5, "squared sine of half the rest")
    small = square < 2.0**-11  # a root is exact from 2^-22 of its argument's range on
    spread = ops.bounded(ops.where(small, 1024.0 * square, square), 0.0, 0.5, "spread")
    root = ops.bounded(spread * ops.rsqrt(spread), 0.0, 0.7188, "root")
    root = ops.where(small, (1.0 / 32.0) * root, root)
    angle = ops.asin_ht(ops.bounded(ops.where(large, root, size), 0.0, 0.7188, "up to 1/2"))
    return ops.flip(
        x < 0.0, ops.bounded(ops.where(large, 0.5 - 2.0 * angle, angle), 0.0, 0.5, "arc sine")
    )


def acos_ht(x: Any) -> Any:
    """Half turns whose cosine is ``x``, [0, 1]; arguments are clamped to [-1, 1]."""
    return ops.bounded(0.5 - asin_ht(x), 0.0, 1.0, "arc cosine")


def roll_pitch_heading_ht(c: Matrix, inverse: Any = 1.0) -> tuple[Any, Any, Any]:
    """Angles [half turns] of C = Rz(heading) Ry(pitch) Rx(roll), as of north-east-down axes.

    ``c`` is C, or up to four times it, C over ``inverse``.
    """
    square = c[2][1] * c[2][1] + c[2][2] * c[2][2]
    secant = ops.rsqrt(square)
    largest = 1.0 if isinstance(inverse, float) else 4.0
    cosine = ops.bounded(square * secant, 0.0, largest, "cosine of the pitch", unless=NO_ROTATION)
    return (
        unit_angle_ht(c[2][1], c[2][2], secant),
        unit_angle_ht(-c[2][0], cosine, inverse),
        unit_angle_ht(c[1][0], c[0][0], secant),
    )


def pitch_roll_heading_ht(c: Matrix) -> tuple[Any, Any, Any]:
    """Angles [half turns] of C = Rz(heading) Rx(pitch) Ry(roll), as of east-north-up axes."""
    square = c[2][2] * c[2][2] + c[2][0] * c[2][0]
    secant = ops.rsqrt(square)
    cosine = ops.bounded(square * secant, 0.0, 1.0, "cosine of the pitch", unless=NO_ROTATION)
    return (
        unit_angle_ht(c[2][1], cosine),
        ops.wrap_ht(-unit_angle_ht(c[2][0], c[2][2], secant)),
        ops.wrap_ht(-unit_angle_ht(c[0][1], c[1][1], secant)),
    )


def euler_ht(q: Vector, norm_rsqrt: Any = 1.0) -> tuple[Any, Any, Any]:
    """Pitch, roll, heading [half turns] of a quaternion, C = Rz(psi) Rx(theta) Ry(gamma).

    Half the sum and half the difference of heading and roll are arc tangents of quaternion
    components; the pitch then needs neither a case for the pole nor a third root::

        w + x = r cos((psi + gamma)/2)    y + z = r sin((psi + gamma)/2)    r = sqrt(1 + sin theta)
        w - x = s cos((psi - gamma)/2)    z - y = s sin((psi - gamma)/2)    s = sqrt(1 - sin theta)
        theta = +-(pi/2 - 2 asin(min(r, s) / sqrt(2)))      plus where s < r

    The norm of ``q`` is 1/``norm_rsqrt``, between 1/16 and 2.
    """
    w, x, y, z = q
    pairs = [(y + z, w + x), (z - y, w - x)]
    squares = [c * c + s * s for s, c in pairs]
    inverses = [ops.rsqrt(n) for n in squares]
    half_sum, half_difference = (
        unit_angle_ht(s, c, inverse) for (s, c), inverse in zip(pairs, inverses, strict=True)
    )
    scale = ops.saturated(norm_rsqrt * math.sqrt(0.5), 16.0)
    roots = [
        ops.saturated(ops.saturated(n * scale, 4.0) * inverse, 2.0)
        for n, inverse in zip(squares, inverses, strict=True)
    ]
    low = squares[0] < squares[1]
    sine = ops.saturated(ops.where(low, roots[0], roots[1]), 2.0)  # at most sqrt(1/2)
    pitch = ops.flip(low, 0.5 - 2.0 * ops.asin_ht(sine))
    return (
        ops.wrap_ht(pitch),
        ops.wrap_ht(half_sum - half_difference),
        ops.wrap_ht(half_sum + half_difference),
    )
