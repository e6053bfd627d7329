"""Sums over millions of steps in two words: the second holds what the first rounds away."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from boresight.model import ops

BELOW = 1.0 - 2.0**-31  #: largest word of a range up to one.


def carried(
    high: Any,
    low: Any,
    moves: Sequence[Any],
    limit: float,
    begin: Any,
    first: Any = 0.0,
    after: Sequence[Any] = (),
) -> tuple[Any, Any]:
    """``high`` + ``low`` + ``moves`` in two words: rounding does not move the sum.

    The state ``high`` is at most ``limit``, a power of two, and its rest ``low`` 2^-15 of it; a
    clamped state loses what the rest does not hold. ``moves`` are scalars, or pairs whose product
    is not rounded. Where ``begin`` holds the sum becomes ``first``. ``after`` is like ``moves``,
    but is added to ``first``, too. 3 + 2 slots, and two for every move.
    """
    # Sum by sum: a part that both shared would become a word, and be rounded.
    total = ops.where(begin, first, _moved(high + low, moves))
    total = _moved(total, after)
    total = ops.bounded(ops.saturated(total, limit), -limit, limit * BELOW, "saturated")
    start = high - total + low
    rest = _moved(start, moves)
    rest = ops.where(begin, first - total if after else 0.0, rest)
    rest = ops.saturated(_moved(rest, after), limit * 2.0**-15)
    return total, ops.bounded(rest, -limit * 2.0**-15, limit * 2.0**-15 * BELOW, "saturated")


def _moved(total: Any, moves: Sequence[Any]) -> Any:
    for move in moves:
        total = total + (move[0] * move[1] if isinstance(move, tuple) else move)
    return total
