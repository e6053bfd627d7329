"""The interval of each kind of node, from those of its arguments."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import LEAVES, Node
from boresight.sim.ranges.claims import Claim, Proof, live
from boresight.sim.ranges.polynomials import ends_of_product

__all__ = [
    "Ends",
    "ends_in_order",
    "ends_of",
    "interval_needs",
    "interval_of",
    "product_of",
    "proof_in_order",
]

FloatArray = npt.NDArray[np.float64]
#: Ends (boxes,) of a value.
Ends = tuple[FloatArray, FloatArray]


def interval_needs(
    node: Node, intervals: Mapping[int, tuple[float, float]] | None = None
) -> Sequence[Node]:
    """Arguments from whose intervals that of a node follows: not a condition that only selects.

    ``intervals``: of arguments, by number, that hold in any case; of others any value.
    """
    intervals = intervals or {}
    if node.kind not in _ENDS:
        return node.args
    ends = [(np.array([arg.low]), np.array([arg.high])) for arg in node.args]
    arguments: list[Node] = []
    for k, arg in enumerate(node.args):
        interval = intervals.get(arg.number, (-math.inf, math.inf))
        arg_ends, ends[k] = ends[k], (np.array([interval[0]]), np.array([interval[1]]))
        with np.errstate(all="ignore"):
            low, high = _ENDS[node.kind](node, ends)
        if not (node.low <= low and high <= node.high):
            arguments.append(arg)
            ends[k] = arg_ends
    return arguments


def interval_of(node: Node, args: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Ends of a node from those of its arguments, within its own."""
    ends = [(np.array([low]), np.array([high])) for low, high in args]
    with np.errstate(all="ignore"):
        lower, upper = _ENDS[node.kind](node, ends)
    return float(np.fmax(node.low, lower[0])), float(np.fmin(node.high, upper[0]))


def ends_in_order(nodes: Mapping[int, Node]) -> dict[int, tuple[float, float]]:
    """Ends of the nodes of a step, each after its arguments, also of x - f x = (1 - f) x."""
    ends: dict[int, tuple[float, float]] = {}
    for number, node in nodes.items():
        ends[number] = node.low, node.high
        if node.kind in _ENDS:
            ends[number] = interval_of(node, [ends[a.number] for a in node.args])
        operands = _part_of(node)
        if operands is not None:
            (low, high), (f_low, f_high) = (ends[n.number] for n in operands)
            low, high = ends_of_product((low, high), (1.0 - f_high, 1.0 - f_low))
            ends[number] = max(low, ends[number][0]), min(high, ends[number][1])
    return ends


def proof_in_order(claim: Claim, ends: Mapping[int, tuple[float, float]]) -> Proof | None:
    """Prove a claim by `ends_in_order`: from the intervals of leaves and other claims."""
    if claim.node.number not in ends or not claim.holds(*ends[claim.node.number]):
        return None
    nodes = live([claim.node], lambda n: () if n.kind == "bounded" else n.args)
    return Proof("intervals in order", tuple(n for n in nodes if n.kind in (*LEAVES, "bounded")))


def _part_of(node: Node) -> tuple[Node, Node] | None:
    """x and f of x - f x; None: it is of another form."""
    if node.kind != "sum" or node.signs != (1, -1) or node.args[1].kind != "mul":
        return None
    x, (a, b) = node.args[0], node.args[1].args
    return (x, b) if a is x else (x, a) if b is x else None


def ends_of(node: Node, args: Sequence[Ends]) -> Ends:
    """Ends (boxes,) of a node from those of its arguments."""
    return _ENDS[node.kind](node, [*args])


def product_of(x: Ends, y: Ends) -> Ends:
    """Ends of a product; 0 times infinity is 0."""
    corners = [np.where((a == 0.0) | (b == 0.0), 0.0, a * b) for a in x for b in y]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _sum(node: Node, args: list[Ends]) -> Ends:
    lower = sum(a[0] if s > 0 else -a[1] for a, s in zip(args, node.signs, strict=True))
    upper = sum(a[1] if s > 0 else -a[0] for a, s in zip(args, node.signs, strict=True))
    return np.asarray(lower), np.asarray(upper)


def _mul(node: Node, args: list[Ends]) -> Ends:
    a, b = args[0]
    if node.args[0] is node.args[1]:
        return _even_ends(a * a, b * b, (a <= 0.0) & (b >= 0.0))
    if node.args[1].kind == "rsqrt" and node.args[1].args[0] is node.args[0]:
        return np.sqrt(np.maximum(a, 0.0)), np.sqrt(np.maximum(b, 0.0))
    return product_of(*args)


def _even_ends(x: FloatArray, y: FloatArray, crosses_zero: npt.NDArray[np.bool_]) -> Ends:
    """Ends of an even function whose values at the ends are x and y, and 0 at 0."""
    return np.where(crosses_zero, 0.0, np.minimum(x, y)), np.maximum(x, y)


def _select(node: Node, args: list[Ends]) -> Ends:
    (c, d), yes, no = args
    if node.args[0] is node.args[-1]:  # chosen where it is not negative
        no = np.maximum(no[0], 0.0), np.maximum(no[1], 0.0)
    lower = np.where(d < 0.0, yes[0], np.where(c >= 0.0, no[0], np.minimum(yes[0], no[0])))
    return lower, np.where(d < 0.0, yes[1], np.where(c >= 0.0, no[1], np.maximum(yes[1], no[1])))


def _flip(node: Node, args: list[Ends]) -> Ends:
    condition, (a, b) = args
    return _select(node, [condition, (-b, -a), (a, b)])


def _abs(node: Node, args: list[Ends]) -> Ends:
    a, b = args[0]
    return _even_ends(np.abs(a), np.abs(b), (a <= 0.0) & (b >= 0.0))


def _wrap(node: Node, args: list[Ends]) -> Ends:
    a, b = args[0]
    turn = np.floor(a / node.value + 0.5)
    same_turn = turn == np.floor(b / node.value + 0.5)
    half = 0.5 * node.value
    return (
        np.where(same_turn, a - turn * node.value, -half),
        np.where(same_turn, b - turn * node.value, half),
    )


def _sin(node: Node, args: list[Ends]) -> Ends:
    a, b = (end + 0.5 * node.quarter for end in args[0])
    x, y = np.sin(np.pi * a), np.sin(np.pi * b)
    top = np.floor((b - 0.5) / 2.0) > np.floor((a - 0.5) / 2.0)
    bottom = np.floor((b + 0.5) / 2.0) > np.floor((a + 0.5) / 2.0)
    return np.where(bottom, -1.0, np.minimum(x, y)), np.where(top, 1.0, np.maximum(x, y))


def _asin(node: Node, args: list[Ends]) -> Ends:
    a, b = (np.arcsin(np.clip(end, 0.0, 1.0)) / np.pi for end in args[0])
    return a, b


def _rsqrt(node: Node, args: list[Ends]) -> Ends:
    a, b = args[0]
    return 1.0 / np.sqrt(np.maximum(b, 0.0)), 1.0 / np.sqrt(np.maximum(a, 0.0))


def _reciprocal(node: Node, args: list[Ends]) -> Ends:
    a, b = args[0]
    crosses_zero = (a < 0.0) & (b >= 0.0)
    return np.where(crosses_zero, -np.inf, 1.0 / b), np.where(crosses_zero, np.inf, 1.0 / a)


_ENDS: dict[str, Callable[[Node, list[Ends]], Ends]] = {
    "sum": _sum,
    "mul": _mul,
    "select": _select,
    "flip": _flip,
    "complement": _flip,
    "abs": _abs,
    "wrap": _wrap,
    "bounded": lambda node, args: args[0],
    "saturated": lambda node, args: (
        np.clip(args[0][0], -node.value, node.value),
        np.clip(args[0][1], -node.value, node.value),
    ),
    "sin": _sin,
    "asin": _asin,
    "rsqrt": _rsqrt,
    "reciprocal": _reciprocal,
}
