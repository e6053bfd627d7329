"""The interval of each kind of node, from those of its arguments."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import Node

FloatArray = npt.NDArray[np.float64]
#: Ends (boxes,) of a value.
Ends = tuple[FloatArray, FloatArray]


def ends_of(node: Node, args: Sequence[Ends]) -> Ends:
    """Ends (boxes,) of a node from those of its arguments; of other kinds its own interval."""
    if node.kind not in _ENDS:
        return np.full_like(args[0][0], node.low), np.full_like(args[0][1], node.high)
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
