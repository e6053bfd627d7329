"""Narrower ranges of states and inputs: what runs suggest, what each would gain, and the patch."""

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


#: Just below a power of two, which would take a bit of its own.
_BELOW = 0.999
#: Width for which bits are counted; the difference is that of any.
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
        Ranges: as it is, as the records (not the hostile runs) had it, as it could be.
    bits : int
        What its format gains.
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
    """Those that gain bits, most bits first; none for angles that wrap.

    The rule is that of formats (`sim.fit.choose.chosen`). What physics allows beyond the records,
    its author knows.
    """
    estimator, trace = fit.estimator, fit.trace
    after = {
        leaf.number: joined({0: fit.seen[leaf.number]}, {0: fit.seen[e.number]})[0]
        for leaf, _, e in trace.states
        if leaf.number in fit.seen and e.number in fit.seen
    }
    seen = {**fit.seen, **after}
    out = []
    leaves = {"input": trace.inputs, "state": [leaf for leaf, _, _ in trace.states]}
    declared: Mapping[str, Sequence[Input | State]] = {
        "input": estimator.inputs,
        "state": estimator.states,
    }
    for kind, those in declared.items():
        for d, leaf in zip(those, leaves[kind], strict=True):
            made = None if d.unit in PERIODS else _narrower(d.low, d.high, seen.get(leaf.number))
            if made is not None:
                before, now = (Format.for_range(_WORD, *r).frac for r in ((d.low, d.high), made))
                reached = seen[leaf.number]
                values = (d.unit, d.line, (d.low, d.high), reached, made, now - before)
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


def with_ranges(estimator: Estimator, those: Sequence[Proposal]) -> Estimator:
    """A copy with the proposed ranges."""
    other = copy.copy(estimator)
    made = {(p.kind, p.name): p.proposed for p in those}

    def narrowed(kind: str, d: Input | State) -> Input | State:
        low, high = made.get((kind, d.name), (d.low, d.high))
        return replace(d, low=low, high=high)

    other.inputs = tuple(narrowed("input", d) for d in estimator.inputs)  # type: ignore[misc]
    other.states = tuple(narrowed("state", d) for d in estimator.states)  # type: ignore[misc]
    return other


def worth(
    fit: Fitted,
    those: Sequence[Proposal],
    records: Mapping[str, Inputs],
    *,
    params: Mapping[str, float] | None = None,
    word: int = 32,
) -> Effect | str:
    """Fixed point against float64 with these proposals and a profile that is made with them."""
    other = with_ranges(fit.estimator, those)
    trace = other.record()
    profile = profile_of(trace, other, fit.seen, fit.hostile, fit.profile.logs)
    return effect(other, profile, records, params=params, word=word)


def applied(source: str, those: Sequence[Proposal]) -> tuple[str, list[Proposal]]:
    """The text of a file with the proposed ranges, and the proposals that it has no place for.

    A place is ``State("name", LOW, HIGH, ...)`` or ``Input(...)`` with the name written out; what a
    loop declares has none.
    """
    lines = source.splitlines(keepends=True)
    starts = np.cumsum([0, *(len(line.encode()) for line in lines)])
    data, edits, left = source.encode(), [], list(those)
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Call(func=ast.Name(id=kind), args=[ast.Constant(value=name), low, high, *_]):
                for p in [p for p in left if (p.kind.capitalize(), p.name) == (kind, name)]:
                    left.remove(p)
                    for edge, value in zip((low, high), p.proposed, strict=True):
                        first = starts[edge.lineno - 1] + edge.col_offset
                        last = starts[(edge.end_lineno or 1) - 1] + (edge.end_col_offset or 0)
                        edits.append((int(first), int(last), f"{value!r}".encode()))
    for first, last, text in sorted(edits, reverse=True):
        data = data[:first] + text + data[last:]
    return data.decode(), left
