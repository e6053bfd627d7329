"""Ranges chosen from what was seen: margin, half of what is left, and what keeps its interval."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any

from boresight.model.estimator import Estimator
from boresight.model.lowering.expand import Expansion
from boresight.model.lowering.graph import Flag
from boresight.model.lowering.profile import Profile, Range, record_digest
from boresight.model.lowering.trace import Trace
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.rounded import binary_exponent
from boresight.sim.fit.observe import Reached, joined

__all__ = ["MARGIN_BITS", "between", "chosen", "intervals", "profile_of"]

#: Bits above the largest value that was seen.
MARGIN_BITS = 2.0
#: Bits above the largest value of hostile runs.
HOSTILE_BITS = 1.0
#: Most bits that half of what is left gives besides, and bits where nothing limits a value.
MOST_BITS, UNLIMITED_BITS = 3.0, 2.0
#: Share of the smallest divisor that was seen, below which it is held where intervals reach zero.
FLOOR = 2.0**-4
#: Largest divisor that a word can hold beside the smallest.
WIDEST = 2.0 ** Arithmetic(word=32).norm_max
#: Functions of which the last argument must stay off zero.
_DIVIDING = ("div", "rsqrt", "sqrt")


def chosen(seen: Range, provoked: Range | None, interval: Range) -> Range | None:
    """Range for the format of a value; None: its interval.

    `MARGIN_BITS` above the largest magnitude seen in records, and half of the bits that then are
    left to the interval, at most `MOST_BITS`; `HOSTILE_BITS` above that of hostile runs, where that
    is more. The sign is that of the interval.
    """
    size, limit = (max(abs(low), abs(high)) for low, high in (seen, interval))
    hostile = 0.0 if provoked is None else max(map(abs, provoked)) * 2.0**HOSTILE_BITS
    size *= 2.0**MARGIN_BITS
    if not 0.0 < size < limit:
        return None
    spare = UNLIMITED_BITS
    if math.isfinite(limit):
        spare = min(0.5 * math.log2(limit / size), MOST_BITS)
    size = max(size * 2.0**spare, hostile)
    if size >= limit:
        return None
    if math.isfinite(limit) and binary_exponent(size) == binary_exponent(limit):
        return None
    return max(interval[0], -size), min(interval[1], size)


def intervals(trace: Trace, seen: Reached) -> tuple[dict[int, Range], dict[int, Range]]:
    """Interval of each expression, and the limits that it needs.

    Parameters
    ----------
    seen : mapping of int to (float, float)
        What each expression reached. A divisor, or the argument of a root, that no interval keeps
        on its side of zero is held at `FLOOR` of the smallest one seen; a divisor whose interval
        spans more than any word can divide by, below what was seen with all margins.

    Returns
    -------
    intervals, limits : dict of int to (float, float)
        By the number of the expression; see `Profile`.

    Raises
    ------
    InputError
        See `model.lowering.expand.expand`; a divisor was seen on both sides of zero.
    """
    graph, made, limits = Expansion(trace.tracer.name), list[Any](), dict[int, Range]()
    for e in trace.tracer.expressions:
        graph.line = e.line
        args = [made[a.number] for a in e.args]
        held = _held(e.kind, args, seen.get(e.args[-1].number)) if e.args else None
        if held is not None:
            limits[e.number] = held
            args[-1] = graph.limited(args[-1], *held)
        made.append(getattr(graph, e.kind)(*args, *e.data))
    nodes = [m.node if isinstance(m, Flag) else m for m in made]
    return {k: (node.low, node.high) for k, node in enumerate(nodes)}, limits


def _held(kind: str, args: Sequence[Any], seen: Range | None) -> Range | None:
    """Where to hold the last argument of a division or root; None where it may stay as it is.

    A divisor that its author holds off zero stays as near to it as that.
    """
    if kind not in _DIVIDING or seen is None:
        return None
    node, (low, high) = args[-1], seen
    room = 2.0 ** (MARGIN_BITS + UNLIMITED_BITS)
    if kind == "div" and low * high > 0.0:
        near, far = (node.low, node.high) if low > 0.0 else (-node.high, -node.low)
        if near <= 0.0 or far > near * WIDEST:
            least, most = sorted((abs(low), abs(high)))
            held = near if near > 0.0 else least * FLOOR, most * room
            return held if low > 0.0 else (-held[1], -held[0])
    if kind != "div" and node.low < 0.0 <= low:
        return low * FLOOR, high * room
    return None


def between(trace: Trace, elements: Collection[str]) -> set[int]:
    """Numbers of the expressions that lead from some states to what replaces any of them.

    Parameters
    ----------
    elements : collection of str
        Names of the states: the covariance of a filter made by `boresight.kalman`, whose ranges
        are proven. A value between that saturates would take its positiveness.
    """
    own = [(leaf, after) for leaf, _, after in trace.states if leaf.data[1] in elements]
    behind, ahead = {leaf.number for leaf, _ in own}, {after.number for _, after in own}
    for e in trace.tracer.expressions:
        if any(a.number in behind for a in e.args):
            behind.add(e.number)
    for e in reversed(trace.tracer.expressions):
        if e.number in ahead:
            ahead.update(a.number for a in e.args)
    return behind & ahead


def profile_of(
    trace: Trace, estimator: Estimator, seen: Reached, provoked: Reached, logs: Sequence[str]
) -> Profile:
    """The profile for what was seen in records and provoked by hostile inputs.

    Parameters
    ----------
    trace : Trace
        The record of ``estimator``.
    logs : sequence of str
        Names of what was run.

    Raises
    ------
    InputError
        See `intervals`.
    """
    said, limits = intervals(trace, joined(seen, provoked))
    fixed = {e.args[-1].number for e in trace.tracer.expressions if e.kind in _DIVIDING}
    fixed |= between(trace, estimator.covariance_elements)
    ranges: dict[int, Range] = {}
    for e in trace.needed:
        known = e.number in fixed and math.isfinite(sum(said[e.number]))
        if e.args and e.number in seen and not known:
            range_ = chosen(seen[e.number], provoked.get(e.number), said[e.number])
            ranges |= {} if range_ is None else {e.number: range_}
    return Profile(
        estimator.name, record_digest(trace, estimator.inputs), tuple(logs), ranges, limits
    )
