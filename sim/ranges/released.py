"""A step without some of its claims.

The word of a claim's value holds it within the word's format, whatever the claim, and what has no
word of its own is its argument. Intervals follow anew from that; a value that may now leave the
format of its word counts as any number of the format.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.model.words.fixed import Format
from boresight.model.words.program import Program
from boresight.sim.ranges.claims import Claim
from boresight.sim.ranges.intervals import interval_of
from boresight.sim.ranges.steps import live_nodes, may_fuse

__all__ = ["released"]


def released(
    program: Program,
    nodes: Mapping[int, Node],
    claims: Collection[Claim],
    states: Mapping[int, tuple[float, float]],
) -> dict[int, Node]:
    """Nodes by their own numbers; those that rest on none of the claims are the same.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    claims
        Those without which; of next states, none.
    states
        Intervals of states, by number: of those that leave their declared ranges, which count as
        inputs, or within these.
    """
    free = {(c.node.number, c.low, c.high) for c in claims}
    forms: dict[int, list[Format]] = {}
    for value, node in nodes.items():
        forms.setdefault(node.number, []).append(program.format(value))
    new: dict[int, Node] = {}
    for number, node in live_nodes(program, nodes).items():
        if number in states:
            low, high = states[number]
            kind = node.kind if node.low <= low and high <= node.high else "input"
            new[number] = replace(node, kind=kind, low=low, high=high)
            continue
        args = tuple(new[a.number] for a in node.args)
        is_free = node.kind == "bounded" and (args[0].number, node.low, node.high) in free
        if not is_free and all(a is b for a, b in zip(args, node.args, strict=True)):
            new[number] = node
            continue
        low, high = node.low, node.high
        if is_free or node.kind != "bounded":
            ends = [(a.low, a.high) for a in args]
            low, high = _ends(replace(node, args=args), ends, node.args)
        new[number] = replace(node, args=args, low=low, high=high)
        for form in forms.get(number, ()):
            room = 2.0 * form.lsb
            if low < min(node.low, form.min - room) or high > max(node.high, form.max + room):
                low, high = (-math.inf, math.inf) if may_fuse(node) else (form.min, form.max)
                new[number] = replace(node, kind="input", args=(), low=low, high=high)
                break
    return new


def _ends(
    node: Node, ends: list[tuple[float, float]], before: tuple[Node, ...]
) -> tuple[float, float]:
    """Interval of a node; all numbers where a function is of what it may not be of."""
    free = replace(node, low=-math.inf, high=math.inf)
    (low, high), known = ends[0], before[0]
    if node.kind == "asin" and not known.low <= low <= high <= known.high:
        return -math.inf, math.inf
    if node.kind == "rsqrt" and low < 0.0 or node.kind == "reciprocal" and low <= 0.0 <= high:
        return -math.inf, math.inf
    low, high = interval_of(free, ends)
    return (-math.inf if np.isnan(low) else low), (math.inf if np.isnan(high) else high)
