"""Intervals of a step in each case of an input or state that is compared with several numbers.

A row that is one of several kinds is a sum of terms of which all but one are 0. The interval of the
whole sum, over all kinds, knows nothing of that; the one of each case does. Nothing that is claimed
with `ops.bounded` is taken for granted: what other nodes read is in the format of its word.
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

#: Fewest and most numbers that make cases worth while.
_FEWEST, _MOST = 2, 64


def ends_in_cases(program: Program, nodes: Mapping[int, Node]) -> dict[int, Ends]:
    """Ends (cases,) of the nodes that results need, by number; of none without such a value.

    Of several values that are compared with as many numbers, an input comes first.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """
    formats = {
        node.number: program.format(value) for value, node in nodes.items() if not may_fuse(node)
    }
    own = live_nodes(program, nodes)
    compared = {n: at for n, at in _compared(own).items() if _FEWEST <= len(at) <= _MOST}
    if not compared:
        return {}
    leaf, at = max(compared.items(), key=lambda item: (len(item[1]), own[item[0]].kind == "input"))
    low, high = own[leaf].low, own[leaf].high
    between = sorted(t for t in at if low < t < high)
    starts = np.array([low, *between])
    stops = np.array([*(math.nextafter(t, -math.inf) for t in between), high])
    known: dict[int, Ends] = {leaf: (starts, stops)}
    for number, node in own.items():
        if number in known:
            continue
        if node.kind in LEAVES:
            least, most = np.full(len(starts), node.low), np.full(len(starts), node.high)
        else:
            with np.errstate(all="ignore"):
                least, most = ends_of(node, [known[a.number] for a in node.args])
            least, most = _known(least, -math.inf), _known(most, math.inf)
        if number in formats:
            form = formats[number]
            least, most = np.clip(least, form.min, form.max), np.clip(most, form.min, form.max)
        known[number] = least, most
    return known


def _known(ends: FloatArray, otherwise: float) -> FloatArray:
    return np.where(np.isnan(ends), otherwise, ends)


def _compared(nodes: Mapping[int, Node]) -> dict[int, set[float]]:
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
    """A condition, or those that it is made of."""
    if condition.kind not in ("select", "complement", "flip"):
        return [condition]
    return [part for arg in condition.args for part in _parts(arg)]
