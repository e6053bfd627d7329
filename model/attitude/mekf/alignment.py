"""The attitude of one sample: specific force up, field north, whatever the attitude is.

The body is turned over first where it hangs upside down, so that no turn that follows is near half
a turn from none (1 + u >= 1, u the upper component of the vertical)::

    level      (1 + u, n, -e, 0)        the shortest turn of the vertical (e, n, u) to the top
    to north   (1 + u + w_e, 0, 0, -w_n)   w = (1 + u) (east turned by that, its level components)
                                             = (1 + u) east_en - east_u (e, n)

the attitude of M. D. Shuster and S. D. Oh (1981), Three-axis attitude determination from vector
observations, J. Guidance and Control 4(1), found without a matrix.
"""

from __future__ import annotations

from typing import Any

from boresight.model import ops


def turned_over(over: Any, v: Any, limit: float) -> tuple[Any, Any, Any]:
    """A vector in body axes, half a turn about x where ``over``; components within the limit."""
    x, y, z = v
    turned = (x, ops.flip(over, y), ops.flip(over, z))
    return tuple(ops.saturated(c, limit) for c in turned)


def turns(
    anew: Any, up: Any, east: Any, cosine: Any, sine: Any
) -> tuple[tuple[Any, ...], tuple[Any, Any]]:
    """Level quaternion, and w and z of the turn about the vertical to north.

    Where ``anew`` holds, of the unit vectors ``up`` and ``east``; else the turn is that of the
    cosine and sine. Norms 1.4 to 2 and 0.7 to 2. Of tan(a/2) = sin(a)/(1 + cos(a)) =
    (1 - cos(a))/sin(a), the form that is far from 0/0 is taken.
    """
    top = 1.0 + up[2]
    size = ops.where(anew, 0.5 * top, 1.0)
    cosine = ops.where(anew, 0.5 * (top * east[0] - east[2] * up[0]), cosine)
    sine = ops.where(anew, 0.5 * (east[2] * up[1] - top * east[1]), sine)
    cosine, sine = ops.saturated(cosine, 1.0), ops.saturated(sine, 1.0)
    behind = cosine < 0.0
    turn = (ops.where(behind, sine, size + cosine), ops.where(behind, size - cosine, sine))
    return (top, up[1], -up[0]), turn
