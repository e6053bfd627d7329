"""A step without some of its claims.

Without its claim, a value is within the format of its word, or is its argument if it has no word.
Intervals are computed again from that; a value that may now leave the format of its word counts as
any number of the format.
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
    """Nodes by their numbers; those that depend on none of the claims are unchanged.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    claims
        The claims to leave out; none of next states.
    states
        Intervals of states, by number: within their declared ranges, or beyond; the latter count
        as inputs.
    """
    keys = {(c.node.number, c.low, c.high) for c in claims}
    formats: dict[int, list[Format]] = {}
    for value, node in nodes.items():
        formats.setdefault(node.number, []).append(program.format(value))
    released_nodes: dict[int, Node] = {}
    for number, node in live_nodes(program, nodes).items():
        if number in states:
            low, high = states[number]
            kind = node.kind if node.low <= low and high <= node.high else "input"
            released_nodes[number] = replace(node, kind=kind, low=low, high=high)
            continue
        args = tuple(released_nodes[a.number] for a in node.args)
        is_released = node.kind == "bounded" and (args[0].number, node.low, node.high) in keys
        if not is_released and all(a is b for a, b in zip(args, node.args, strict=True)):
            released_nodes[number] = node
            continue
        low, high = node.low, node.high
        if is_released or node.kind != "bounded":
            ends = [(a.low, a.high) for a in args]
            low, high = _ends(replace(node, args=args), ends, node.args)
        released_nodes[number] = replace(node, args=args, low=low, high=high)
        for form in formats.get(number, ()):
            slack = 2.0 * form.lsb
            if low < min(node.low, form.min - slack) or high > max(node.high, form.max + slack):
                low, high = (-math.inf, math.inf) if may_fuse(node) else (form.min, form.max)
                released_nodes[number] = replace(node, kind="input", args=(), low=low, high=high)
                break
    return released_nodes


def _ends(
    node: Node, ends: list[tuple[float, float]], original_args: tuple[Node, ...]
) -> tuple[float, float]:
    """Interval of a node; all numbers where an argument is outside the domain of its function."""
    unlimited = replace(node, low=-math.inf, high=math.inf)
    (low, high), argument = ends[0], original_args[0]
    if node.kind == "asin" and not argument.low <= low <= high <= argument.high:
        return -math.inf, math.inf
    if node.kind == "rsqrt" and low < 0.0 or node.kind == "reciprocal" and low <= 0.0 <= high:
        return -math.inf, math.inf
    low, high = interval_of(unlimited, ends)
    return (-math.inf if np.isnan(low) else low), (math.inf if np.isnan(high) else high)
