"""The operations estimators are written in: the same code on float64 arrays and on the tracer.

On numpy arrays each function computes in float64, element by element; on traced values
(`model.lowering.graph.Node`) it adds to the graph. On plain numbers its result is correctly rounded
(`model.words.rounded`): such constants become part of a program, and must be the same on every
machine; those of ``math`` and numpy are not. Besides these functions use ``+ - * /``, unary minus
and the comparisons ``< > <= >=`` whose results combine with ``& | ~``.

The range of a divisor must not contain zero nor span more than 2^22. A word that cannot normalise
so much (W < 32) counts a divisor below 2^-(W - 1 - guard) of its full scale as that.

Angles in half turns (suffix ``_ht``): 1 = pi rad, wrapped to [-1, 1).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from boresight.model.lowering.graph import LEAVES, Condition, Node
from boresight.model.words import rounded

__all__ = [
    "absolute",
    "asin_ht",
    "atan2_ht",
    "bounded",
    "clip",
    "flip",
    "maximum",
    "minimum",
    "named",
    "rsqrt",
    "saturated",
    "sincos_ht",
    "sqrt",
    "where",
    "wrap_ht",
]


def _plain(x: Any) -> bool:
    """Whether ``x`` is a number of Python's own, and no element of an array."""
    return type(x) in (int, float)


def named(name: str, x: Any) -> Any:
    """``x``; in the program its value carries this name."""
    if isinstance(x, Node) and x.kind not in LEAVES and x.name is None:
        x.name = name
    return x


def bounded(x: Any, low: float, high: float, reason: str) -> Any:
    """``x``, which its author knows to lie in [low, high] because of ``reason``.

    The fixed-point value takes its format from this range and saturates (with the sticky flag)
    should it ever be wrong. On floats nothing happens.
    """
    return x.graph.bounded(x, low, high, reason) if isinstance(x, Node) else x


def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where the condition holds, else ``no``."""
    if isinstance(condition, Condition):
        g = condition.node.graph
        return g.select(condition, g.lift(yes), g.lift(no))
    return np.where(condition, yes, no)


def saturated(x: Any, limit: float) -> Any:
    """``x`` clamped to [-limit, limit], a power of two: costs nothing in fixed point."""
    return x.graph.saturated(x, limit) if isinstance(x, Node) else np.clip(x, -limit, limit)


def flip(condition: Any, x: Any) -> Any:
    """-x where the condition holds, else ``x``."""
    if isinstance(condition, Condition):
        g = condition.node.graph
        return g.flip(condition, g.lift(x))
    return np.where(condition, -x, x)


def absolute(x: Any) -> Any:
    """|x|."""
    return x.graph.absolute(x) if isinstance(x, Node) else np.abs(x)


def minimum(a: Any, b: Any) -> Any:
    """The smaller of two."""
    return where(a < b, a, b)


def maximum(a: Any, b: Any) -> Any:
    """The larger of two."""
    return where(a < b, b, a)


def clip(x: Any, low: float, high: float) -> Any:
    """``x`` limited to [low, high] (exactly, by comparison).

    What has no finite range yet, as a product with `rsqrt`, gets one on the way.
    """
    if not isinstance(x, Node):
        return np.clip(x, low, high)
    g = x.graph
    if not math.isfinite(x.low + x.high):
        largest = max(abs(low), abs(high)) or 1.0
        x = g.saturated(x, math.ldexp(2.0, rounded.binary_exponent(largest)))
    if x.low < low:
        x = g.bounded(where(x < low, low, x), low, max(x.high, low), "clip")
    if x.high > high:
        x = g.bounded(where(x > high, high, x), min(x.low, high), high, "clip")
    return x


def wrap_ht(x: Any) -> Any:
    """``x`` half turns wrapped to [-1, 1). Exact in fixed point."""
    return x.graph.wrap(x) if isinstance(x, Node) else (x + 1.0) % 2.0 - 1.0


def sincos_ht(x: Any) -> tuple[Any, Any]:
    """sin(pi x), cos(pi x) of ``x`` half turns."""
    if isinstance(x, Node):
        g = x.graph
        return g.function("sin", x), g.function("sin", x, quarter=True)
    if _plain(x):
        return rounded.sin_ht(x), rounded.cos_ht(x)
    return np.sin(np.pi * x), np.cos(np.pi * x)


def rsqrt(x: Any) -> Any:
    """1 / sqrt(x) of x >= 0.

    In fixed point arguments below 2^-22 of the full scale (W = 32) count as that; multiply the
    result by something before you store it, so that its exponent stays free.
    """
    if isinstance(x, Node):
        return x.graph.function("rsqrt", x)
    if _plain(x):
        return rounded.rsqrt(max(x, 1e-300))
    return 1.0 / np.sqrt(np.maximum(x, 1e-300))


def sqrt(x: Any) -> Any:
    """Square root of x >= 0, as x * rsqrt(x): too small below the least argument of `rsqrt`."""
    if isinstance(x, Node):
        if x.kind == "const":
            return x.graph.const(math.sqrt(x.value))
        root = x * x.graph.function("rsqrt", x)
        root.low, root.high = math.sqrt(max(x.low, 0.0)), math.sqrt(max(x.high, 0.0))
        return root
    return np.sqrt(x)


def asin_ht(x: Any) -> Any:
    """Half turns whose sine is ``x`` in [0, 0.7188): up to an eighth of a turn and a little."""
    if isinstance(x, Node):
        return x.graph.function("asin", x)
    if _plain(x):
        return rounded.asin_ht(min(max(x, 0.0), 1.0))
    return np.arcsin(np.clip(x, 0.0, 1.0)) / np.pi


def atan2_ht(y: Any, x: Any) -> Any:
    """Angle of the vector (x, y) in half turns, [-1, 1); of the zero vector 0.

    Fixed point: scale the smaller component to a sine, s = min(|x|,|y|) / sqrt(x^2 + y^2) <= 0.71,
    take asin(s) from its table and unfold the octants::

        swap = x^2 < y^2                             the angle is measured from the y axis
        angle = base +- asin(s),  minus if swap xor (x < 0) xor (y < 0)
        base  = swap ? (y < 0 ? -1/2 : 1/2) : (x < 0 ? 1 : 0)
    """
    if not isinstance(x, Node) and not isinstance(y, Node):
        if _plain(x) and _plain(y):
            angle = rounded.atan2_ht(y, x)
        else:
            angle = np.arctan2(y + 0.0, x + 0.0) / np.pi  # + 0.0: no negative zeros
        return (angle + 1.0) % 2.0 - 1.0
    g = (x if isinstance(x, Node) else y).graph
    x, y = g.lift(x), g.lift(y)
    xx, yy = x * x, y * y
    swap = xx < yy
    sine = g.absolute(where(swap, x, y)) * g.function("rsqrt", xx + yy)
    sine = g.bounded(sine, 0.0, 0.7188, "smaller component of a unit vector")
    sign = g.flip(swap, g.flip(x < 0.0, y))
    base = where(swap, g.flip(y < 0.0, g.const(0.5)), where(x < 0.0, -1.0, 0.0))
    base = g.bounded(base, -1.0, 0.5, "quadrant")  # known early: a group of its own
    return g.wrap(base + g.flip(sign < 0.0, g.function("asin", sine)))
