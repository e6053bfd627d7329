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
        What to write; ``...`` is what stands there.
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
    """What would give a value more bits; None if nothing that is said of it does.

    No advice for what never changed in the logs, and for what follows from its operands: they have
    it.
    """
    said, form = observed.program.values[value], observed.program.format(value)
    gains, (low, high) = wasted_bits(observed.headroom_bits(value)), observed.reached(value)
    # Of a format that is wider than its range, as where terms are aligned, no range takes bits.
    fills = 2.0 * max(-said.low, said.high) >= -form.min
    if not gains or low == high or not fills or said.kind in (Kind.PARAM, Kind.CONST):
        return None
    if said.kind is Kind.OP and not _own_slack(observed, value):
        return None
    full = math.ldexp(-form.min, -gains)
    if isinstance(observed.estimator, Kalman) and not _declared(observed, value):
        return _of_deviation(observed, value, observed.estimator, full, gains)
    limit = float(f"{_BELOW * full:.4g}")
    new_low, new_high = max(said.low, -limit), min(said.high, limit)
    how = _how(observed, value, f"{new_low:.4g}, {new_high:.4g}", full)
    return Advice(said.name, observed.lines.get(value, ""), new_low, new_high, gains, how)


def _how(observed: Observed, value: int, limits: str, full: float) -> str:
    """What its author may write instead."""
    said = observed.program.values[value]
    if said.kind is not Kind.OP:
        name = declared_name(observed.program, observed.nodes, value)
        return f'{said.kind.value.capitalize()}("{name}", {limits}, ...)'
    if observed.nodes[value].kind == "saturated":
        return f"ops.saturated(..., {full:g})"
    return f'ops.bounded(..., {limits}, "why")'


def _declared(observed: Observed, value: int) -> bool:
    """Whether the author of a Kalman filter wrote this range, or may write one at this line."""
    said, kalman = observed.program.values[value], observed.estimator
    if said.kind is Kind.STATE and isinstance(kalman, Kalman):
        declared = [s.name for s in (*kalman.estimated, *kalman.memory) if hasattr(s, "low")]
        return declared_name(observed.program, observed.nodes, value) in declared
    if said.kind is not Kind.OP:
        return True
    node = observed.nodes[value]
    text = node.line.source() if isinstance(node.line, Place) else ""
    if node.kind in ("bounded", "saturated"):
        return node.kind in text
    return not any(f"{name}(" in text for name in ("State", "Attitude", "Measurement"))


def _of_deviation(
    observed: Observed, value: int, kalman: Kalman, full: float, gains: int
) -> Advice | None:
    """What a variance of a Kalman filter needs: its words follow from ``sd_max``."""
    name = observed.program.values[value].name
    i, j = kalman.covariance_states.get(name, (0, -1))
    named = {s.name: s for s in kalman.estimated if isinstance(s, State)}
    state = named.get(kalman.errors[i]) if i == j else None
    most = float(f"{math.sqrt(_BELOW * full):.4g}")
    if state is None or most < state.sd:
        return None
    line = observed.lines.get(value, "")
    how = f'State("{state.name}", ..., sd_max={most:g})'
    return Advice(name, line, 0.0, most * most, gains, how)


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
    within = _interval(observed, node, numbers)
    low, high = observed.reached(value)
    seen = max(-low, high, observed.program.format(value).lsb)
    return within is not None and max(-within[0], within[1]) >= seen * 2.0 ** (RESERVE_BITS + 1)


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
