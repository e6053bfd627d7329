"""Ranges chosen from observed values: margin, half of the spare bits, and exceptions."""

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
from boresight.sim.compare.diagnosis import MARGIN_BITS
from boresight.sim.fit.observe import Reached, joined

#: Bits above the largest value of hostile runs.
HOSTILE_BITS = 1.0
#: Most bits added by half of the spare bits, and bits added where nothing limits a value.
MOST_BITS, UNLIMITED_BITS = 3.0, 2.0
#: Lower limit of a divisor whose interval reaches zero, as a share of the smallest observed one.
FLOOR = 2.0**-4
#: Largest ratio of the divisors that a word can hold.
WIDEST = 2.0 ** Arithmetic(word=32).norm_max
#: Functions whose last argument must not be zero.
_DIVIDING = ("div", "rsqrt", "sqrt")


def chosen(seen: Range, provoked: Range | None, interval: Range) -> Range | None:
    """Range for the format of a value; None: its interval.

    `MARGIN_BITS` above the largest magnitude seen in records, and half of the remaining bits up to
    the interval, at most `MOST_BITS`; or `HOSTILE_BITS` above that of hostile runs, if this is
    more. The sign is that of the interval.
    """
    size, limit = (max(abs(low), abs(high)) for low, high in (seen, interval))
    hostile = 0.0 if provoked is None else max(map(abs, provoked)) * 2.0**HOSTILE_BITS
    size *= 2.0**MARGIN_BITS
    if not 0.0 < size < limit:
        return None
    extra_bits = UNLIMITED_BITS
    if math.isfinite(limit):
        extra_bits = min(0.5 * math.log2(limit / size), MOST_BITS)
    size = max(size * 2.0**extra_bits, hostile)
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
        Observed range of each expression. A divisor or radicand whose interval crosses zero is
        limited to `FLOOR` times the smallest one seen; a divisor whose interval is wider than any
        word can divide by, to the largest one seen with all margins.

    Returns
    -------
    intervals, limits : dict of int to (float, float)
        By the number of the expression; see `Profile`.

    Raises
    ------
    InputError
        See `model.lowering.expand.expand`; a divisor was seen on both sides of zero.
    """
    graph, operands, limits = Expansion(trace.tracer.name), list[Any](), dict[int, Range]()
    for e in trace.tracer.expressions:
        graph.line = e.line
        args = [operands[a.number] for a in e.args]
        range_ = _limits_of(e.kind, args, seen.get(e.args[-1].number)) if e.args else None
        if range_ is not None:
            limits[e.number] = range_
            args[-1] = graph.limited(args[-1], *range_)
        operands.append(getattr(graph, e.kind)(*args, *e.data))
    nodes = [m.node if isinstance(m, Flag) else m for m in operands]
    return {k: (node.low, node.high) for k, node in enumerate(nodes)}, limits


def _limits_of(kind: str, args: Sequence[Any], seen: Range | None) -> Range | None:
    """Limits of the last argument of a division or root; None if it needs none.

    The lower limit of a divisor whose interval excludes zero is that of the interval.
    """
    if kind not in _DIVIDING or seen is None:
        return None
    node, (low, high) = args[-1], seen
    margin = 2.0 ** (MARGIN_BITS + UNLIMITED_BITS)
    if kind == "div" and low * high > 0.0:
        lower, upper = (node.low, node.high) if low > 0.0 else (-node.high, -node.low)
        if lower <= 0.0 or upper > lower * WIDEST:
            smallest, largest = sorted((abs(low), abs(high)))
            ends = lower if lower > 0.0 else smallest * FLOOR, largest * margin
            return ends if low > 0.0 else (-ends[1], -ends[0])
    if kind != "div" and node.low < 0.0 <= low:
        return low * FLOOR, high * margin
    return None


def between(trace: Trace, elements: Collection[str]) -> set[int]:
    """Numbers of the expressions on paths from some states to their next values.

    Parameters
    ----------
    elements : collection of str
        Names of the states: the covariance of a filter made by `boresight.kalman`, whose ranges
        are proven. Saturation of a value in between could make it negative.
    """
    pairs = [(leaf, after) for leaf, _, after in trace.states if leaf.data[1] in elements]
    descendants, ancestors = {s.number for s, _ in pairs}, {after.number for _, after in pairs}
    for e in trace.tracer.expressions:
        if any(a.number in descendants for a in e.args):
            descendants.add(e.number)
    for e in reversed(trace.tracer.expressions):
        if e.number in ancestors:
            ancestors.update(a.number for a in e.args)
    return descendants & ancestors


def profile_of(
    trace: Trace, estimator: Estimator, seen: Reached, provoked: Reached, logs: Sequence[str]
) -> tuple[Profile, dict[int, Range]]:
    """The profile for the ranges seen in records and provoked by hostile inputs, and all intervals.

    Parameters
    ----------
    trace : Trace
        The record of ``estimator``.
    logs : sequence of str
        Names of the logs and worlds.

    Raises
    ------
    InputError
        See `intervals`.
    """
    bounds, limits = intervals(trace, joined(seen, provoked))
    by_interval = {e.args[-1].number for e in trace.tracer.expressions if e.kind in _DIVIDING}
    by_interval |= between(trace, estimator.covariance_elements)
    ranges: dict[int, Range] = {}
    for e in trace.needed:
        keeps_interval = e.number in by_interval and math.isfinite(sum(bounds[e.number]))
        if e.args and e.number in seen and not keeps_interval:
            range_ = chosen(seen[e.number], provoked.get(e.number), bounds[e.number])
            ranges |= {} if range_ is None else {e.number: range_}
    digest = record_digest(trace, estimator.inputs)
    return Profile(estimator.name, digest, tuple(logs), ranges, limits), bounds
