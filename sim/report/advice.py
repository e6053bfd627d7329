"""Which range to narrow, where, and how many bits that gives.

A word whose upper bits no log ever uses rounds coarser than it must. Its bits are lost where the
range is said, or where intervals lose what is known: there, and only there, is the advice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from boresight.model.kalman.declared import State
from boresight.model.kalman.kalman import Kalman
from boresight.model.lowering.graph import Node, declared_name
from boresight.model.places import Place
from boresight.model.words.program import Kind
from boresight.sim.report.observed import Observed

__all__ = ["RESERVE_BITS", "Advice", "advice_of", "wasted_bits"]

#: Bits above the largest word of the logs that are no waste: other logs go further.
RESERVE_BITS = 1
#: Just below a power of two, which would take a bit of its own.
_BELOW = 0.999


@dataclass(frozen=True)
class Advice:
    """A narrower range.

    Attributes
    ----------
    value : str
        Name of the value.
    line : str
        Where it is written; empty if that is not known.
    low, high : float
        The range it may have, in its unit: no power of two, which would take a bit more.
    gains : int
        Bits that its format gains by that.
    how : str
        Text to write; ``...`` stands for the present arguments.
    """

    value: str
    line: str
    low: float
    high: float
    gains: int
    how: str


def wasted_bits(headroom_bits: float) -> int:
    """Whole bits of headroom beyond the reserve."""
    return max(0, math.floor(headroom_bits) - RESERVE_BITS)


def advice_of(observed: Observed, value: int) -> Advice | None:
    """The range that would give a value more bits; None if no declaration of it does.

    No advice for what never changed in the logs, and for what follows from its operands: they have
    it.
    """
    declaration, form = observed.program.values[value], observed.program.format(value)
    gains, (low, high) = wasted_bits(observed.headroom_bits(value)), observed.reached(value)
    # Of a format that is wider than its range, as where terms are aligned, no range takes bits.
    is_full = 2.0 * max(-declaration.low, declaration.high) >= -form.min
    if not gains or low == high or not is_full or declaration.kind in (Kind.PARAM, Kind.CONST):
        return None
    if declaration.kind is Kind.OP and not _own_slack(observed, value):
        return None
    full_scale = math.ldexp(-form.min, -gains)
    if isinstance(observed.estimator, Kalman) and not _declared(observed, value):
        return _deviation_advice(observed, value, observed.estimator, full_scale, gains)
    limit = float(f"{_BELOW * full_scale:.4g}")
    new_low, new_high = max(declaration.low, -limit), min(declaration.high, limit)
    how = _replacement(observed, value, f"{new_low:.4g}, {new_high:.4g}", full_scale)
    return Advice(declaration.name, observed.lines.get(value, ""), new_low, new_high, gains, how)


def _replacement(observed: Observed, value: int, limits: str, full_scale: float) -> str:
    """Source text with which its author may replace the declaration."""
    declaration = observed.program.values[value]
    if declaration.kind is not Kind.OP:
        name = declared_name(observed.program, observed.nodes, value)
        return f'{declaration.kind.value.capitalize()}("{name}", {limits}, ...)'
    if observed.nodes[value].kind == "saturated":
        return f"ops.saturated(..., {full_scale:g})"
    return f'ops.bounded(..., {limits}, "why")'


def _declared(observed: Observed, value: int) -> bool:
    """Whether the author of a Kalman filter wrote this range, or may write one at this line."""
    declaration, kalman = observed.program.values[value], observed.estimator
    if declaration.kind is Kind.STATE and isinstance(kalman, Kalman):
        declared = [s.name for s in (*kalman.estimated, *kalman.memory) if hasattr(s, "low")]
        return declared_name(observed.program, observed.nodes, value) in declared
    if declaration.kind is not Kind.OP:
        return True
    node = observed.nodes[value]
    text = node.line.source() if isinstance(node.line, Place) else ""
    if node.kind in ("bounded", "saturated"):
        return node.kind in text
    return not any(f"{name}(" in text for name in ("State", "Attitude", "Measurement"))


def _deviation_advice(
    observed: Observed, value: int, kalman: Kalman, full_scale: float, gains: int
) -> Advice | None:
    """Advice for a variance of a Kalman filter, whose format follows from ``sd_max``."""
    name = observed.program.values[value].name
    i, j = kalman.covariance_states.get(name, (0, -1))
    states = {s.name: s for s in kalman.estimated if isinstance(s, State)}
    state = states.get(kalman.errors[i]) if i == j else None
    largest = float(f"{math.sqrt(_BELOW * full_scale):.4g}")
    if state is None or largest < state.sd:
        return None
    line = observed.lines.get(value, "")
    how = f'State("{state.name}", ..., sd_max={largest:g})'
    return Advice(name, line, 0.0, largest * largest, gains, how)


def _own_slack(observed: Observed, value: int) -> bool:
    """Whether an operation wastes bits whatever range its operands had."""
    node = observed.nodes.get(value)
    if node is None:
        return False
    if node.kind in ("bounded", "saturated"):
        return True
    numbers = {
        node.number: n for n, node in sorted(observed.nodes.items(), key=lambda item: -item[0])
    }
    bounds = _interval(observed, node, numbers)
    low, high = observed.reached(value)
    limit = max(-low, high, observed.program.format(value).lsb)
    return bounds is not None and max(-bounds[0], bounds[1]) >= limit * 2.0 ** (RESERVE_BITS + 1)


def _interval(
    observed: Observed, node: Node, numbers: dict[int, int]
) -> tuple[float, float] | None:
    """Interval of a node whose operands have the ranges that were seen; None: not computed."""
    args = []
    for arg in node.args:
        number = numbers.get(arg.number)
        if arg.kind == "const":
            args.append((arg.value, arg.value))
        elif number is not None:
            args.append(observed.reached(number))
        elif (part := _interval(observed, arg, numbers)) is not None:
            args.append(part)
        else:
            return None
    if node.kind == "sum":
        ends = [a if s > 0 else (-a[1], -a[0]) for s, a in zip(node.signs, args, strict=True)]
        return sum(a[0] for a in ends), sum(a[1] for a in ends)
    if node.kind == "mul":
        corners = [x * y for x in args[0] for y in args[1]]
        return min(corners), max(corners)
    if node.kind == "select":
        return min(a[0] for a in args[1:]), max(a[1] for a in args[1:])
    if node.kind in ("flip", "abs"):
        largest = max(-args[-1][0], args[-1][1])
        return (0.0 if node.kind == "abs" else -largest), largest
    return None
