"""Narrower ranges of states and inputs: proposals from runs, their gains, and the patch."""

from __future__ import annotations

import ast
import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from boresight.model.declarations import PERIODS, Input, State
from boresight.model.estimator import Estimator
from boresight.model.words.fixed import Format
from boresight.sim.fit.choose import chosen, profile_of
from boresight.sim.fit.fitting import Effect, Fitted, effect
from boresight.sim.fit.observe import Inputs, joined

__all__ = ["Proposal", "applied", "proposals", "with_ranges", "worth"]


#: Factor to just below a power of two, which itself would need one more bit.
_BELOW = 0.999
#: Width for which bits are counted; the difference is the same for any.
_WORD = 32


@dataclass(frozen=True)
class Proposal:
    """A narrower range of an input or a state.

    Attributes
    ----------
    kind : str
        "input" or "state".
    name, unit, line : str
    declared, seen, proposed : (float, float)
        Ranges: as declared, as in the records (not the hostile runs), and as it could be.
    bits : int
        Bits that its format gains.
    """

    kind: str
    name: str
    unit: str
    line: str
    declared: tuple[float, float]
    seen: tuple[float, float]
    proposed: tuple[float, float]
    bits: int


def proposals(fit: Fitted) -> list[Proposal]:
    """Proposals that gain bits, most bits first; none for angles that wrap.

    The rule is that of formats (`sim.fit.choose.chosen`). Only the author knows which values beyond
    the records are physically possible.
    """
    estimator, trace = fit.estimator, fit.trace
    state_ranges = {
        leaf.number: joined({0: fit.seen[leaf.number]}, {0: fit.seen[e.number]})[0]
        for leaf, _, e in trace.states
        if leaf.number in fit.seen and e.number in fit.seen
    }
    ranges = {**fit.seen, **state_ranges}
    out = []
    leaves = {"input": trace.inputs, "state": [leaf for leaf, _, _ in trace.states]}
    declarations: Mapping[str, Sequence[Input | State]] = {
        "input": estimator.inputs,
        "state": estimator.states,
    }
    for kind, group in declarations.items():
        for d, leaf in zip(group, leaves[kind], strict=True):
            span = None if d.unit in PERIODS else _narrower(d.low, d.high, ranges.get(leaf.number))
            if span is not None:
                before, now = (Format.for_range(_WORD, *r).frac for r in ((d.low, d.high), span))
                reached = ranges[leaf.number]
                values = (d.unit, d.line, (d.low, d.high), reached, span, now - before)
                out += [Proposal(kind, d.name, *values)] if now > before else []
    return sorted(out, key=lambda p: -p.bits)


def _narrower(
    low: float, high: float, seen: tuple[float, float] | None
) -> tuple[float, float] | None:
    range_ = None if seen is None else chosen(seen, None, (low, high))
    if range_ is None:
        return None
    full = 2.0 ** math.ceil(math.log2(max(-range_[0], range_[1])))
    limit = float(f"{_BELOW * full:.4g}")
    return max(low, -limit), min(high, limit)


def with_ranges(estimator: Estimator, changes: Sequence[Proposal]) -> Estimator:
    """A copy with the proposed ranges."""
    variant = copy.copy(estimator)
    ranges = {(p.kind, p.name): p.proposed for p in changes}

    def narrowed(kind: str, d: Input | State) -> Input | State:
        low, high = ranges.get((kind, d.name), (d.low, d.high))
        return replace(d, low=low, high=high)

    variant.inputs = tuple(narrowed("input", d) for d in estimator.inputs)  # type: ignore[misc]
    variant.states = tuple(narrowed("state", d) for d in estimator.states)  # type: ignore[misc]
    return variant


def worth(
    fit: Fitted,
    changes: Sequence[Proposal],
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    word: int = 32,
) -> Effect | str:
    """Fixed point against float64 with these proposals and the profile that follows from them."""
    variant = with_ranges(fit.estimator, changes)
    trace = variant.record()
    profile = profile_of(trace, variant, fit.seen, fit.hostile, fit.profile.logs)
    return effect(variant, profile, records, params=params, word=word)


def applied(source: str, changes: Sequence[Proposal]) -> tuple[str, list[Proposal]]:
    """The text of a file with the proposed ranges, and the proposals without a place in it.

    A place is ``State("name", LOW, HIGH, ...)`` or ``Input(...)`` with a literal name; declarations
    in a loop have none.
    """
    lines = source.splitlines(keepends=True)
    starts = np.cumsum([0, *(len(line.encode()) for line in lines)])
    data, edits, unplaced = source.encode(), [], list(changes)
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Call(func=ast.Name(id=kind), args=[ast.Constant(value=name), low, high, *_]):
                for p in [p for p in unplaced if (p.kind.capitalize(), p.name) == (kind, name)]:
                    unplaced.remove(p)
                    for edge, value in zip((low, high), p.proposed, strict=True):
                        first = starts[edge.lineno - 1] + edge.col_offset
                        last = starts[(edge.end_lineno or 1) - 1] + (edge.end_col_offset or 0)
                        edits.append((int(first), int(last), f"{value!r}".encode()))
    for first, last, text in sorted(edits, reverse=True):
        data = data[:first] + text + data[last:]
    return data.decode(), unplaced
