"""Intervals of a step in each case of an input or state that is compared with several numbers.

A row that is one of several kinds is a sum of terms of which all but one are 0. The interval of the
sum over all kinds does not show that; the interval in each case does. Claims of `ops.bounded` are
not assumed: the values that other nodes read are in the formats of their words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import LEAVES, Node
from boresight.model.words.program import Program
from boresight.sim.ranges.intervals import Ends, ends_of
from boresight.sim.ranges.polynomials import polynomial_of
from boresight.sim.ranges.steps import live_nodes, may_fuse

__all__ = ["ends_in_cases"]

FloatArray = npt.NDArray[np.float64]

#: Fewest and most numbers from which cases are made.
_FEWEST, _MOST = 2, 64


def ends_in_cases(program: Program, nodes: Mapping[int, Node]) -> dict[int, Ends]:
    """Ends (cases,) of the nodes that results need, by number; empty without such a value.

    The value that is compared with most numbers makes the cases; of equals, an input.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """
    formats = {
        node.number: program.format(value) for value, node in nodes.items() if not may_fuse(node)
    }
    live = live_nodes(program, nodes)
    levels = {n: at for n, at in _levels_in(live).items() if _FEWEST <= len(at) <= _MOST}
    if not levels:
        return {}
    leaf, at = max(levels.items(), key=lambda item: (len(item[1]), live[item[0]].kind == "input"))
    low, high = live[leaf].low, live[leaf].high
    inner_levels = sorted(t for t in at if low < t < high)
    starts = np.array([low, *inner_levels])
    stops = np.array([*(math.nextafter(t, -math.inf) for t in inner_levels), high])
    ends: dict[int, Ends] = {leaf: (starts, stops)}
    for number, node in live.items():
        if number in ends:
            continue
        if node.kind in LEAVES:
            lower, upper = np.full(len(starts), node.low), np.full(len(starts), node.high)
        else:
            with np.errstate(all="ignore"):
                lower, upper = ends_of(node, [ends[a.number] for a in node.args])
            lower, upper = _without_nan(lower, -math.inf), _without_nan(upper, math.inf)
        if number in formats:
            form = formats[number]
            lower, upper = np.clip(lower, form.min, form.max), np.clip(upper, form.min, form.max)
        ends[number] = lower, upper
    return ends


def _without_nan(ends: FloatArray, otherwise: float) -> FloatArray:
    return np.where(np.isnan(ends), otherwise, ends)


def _levels_in(nodes: Mapping[int, Node]) -> dict[int, set[float]]:
    """The numbers that selections compare each input and state with."""
    out: dict[int, set[float]] = {}
    for node in nodes.values():
        if node.kind in ("select", "flip"):
            for condition in _parts(node.args[0]):
                form = polynomial_of(condition, 2, 2) or {}
                linear = [(m[0], c) for m, c in form.items() if len(m) == 1]
                if len(linear) == 1 and len(form) <= 2 and form.keys() <= {(), (linear[0][0],)}:
                    leaf, factor = linear[0]
                    if nodes[leaf].kind in ("input", "state"):
                        out.setdefault(leaf, set()).add(-form.get((), 0.0) / factor)
    return out


def _parts(condition: Node) -> list[Node]:
    """A condition, or those that it combines."""
    if condition.kind not in ("select", "complement", "flip"):
        return [condition]
    return [part for arg in condition.args for part in _parts(arg)]
