"""Interpolation in a small table: straight lines between points, the same on floats and the tracer.

With points (a_k, y_k) and slopes s_k between them::

    h_k = max(x - a_k, 0)        y = y_0 + sum_k s_k (h_k - h_k+1)

Distances and points have the resolution of x or half of it; one accumulator adds all products
and rounds once. Each point costs 5 slots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from boresight.model import ops
from boresight.model.errors import require
from boresight.model.places import author_line

#: Room for rounding in the result's range, as a share of it.
_SLACK = 2e-8


def interpolated(x: Any, points: Sequence[float], values: Sequence[float]) -> Any:
    """Value at ``x`` between points, as `numpy.interp`; constant beyond the ends.

    Parameters
    ----------
    x : scalar
    points : sequence of float (n,)
        Arguments, rising, at least two.
    values : sequence of float (n,)
        Values of the function at the points.

    Raises
    ------
    InputError
        The points do not rise, a number is not finite, or the lengths differ.
    """
    a, y = [[float(v) for v in column] for column in (points, values)]
    fix = "give two or more points with their values"

    def where() -> str:
        return author_line() or "interpolated"

    require(len(a) == len(y) >= 2, where, "as many values as points", (len(a), len(y)), fix)
    valid = all(map(math.isfinite, a + y)) and all(b > c for c, b in pairwise(a))
    require(valid, where, "finite points that rise", a, "sort them, each once")
    slopes = [(y[k + 1] - y[k]) / (a[k + 1] - a[k]) for k in range(len(a) - 1)]
    ramps = [ops.maximum(x - point, 0.0) for point in a]
    total: Any = y[0]
    for slope, (ramp, next_ramp) in zip(slopes, pairwise(ramps), strict=True):
        total = total + slope * ramp - slope * next_ramp
    low, high = min(y), max(y)
    slack = _SLACK * max(high - low, abs(low), abs(high))
    return ops.bounded(total, low - slack, high + slack, "values of the table")
