"""The interval of each kind of node, and proofs of ranges on boxes, each halved until it decides.

A value is a function of the values that it is computed from, some steps back, each anywhere in its
known interval. The interval of the function over the whole box may be too wide, because the same
value occurs twice or a selection is undecided. Then both halves of the box are tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.lowering.graph import LEAVES, Node

Ends = tuple[FloatArray, FloatArray]  #: Ends (boxes,) of a value.


def ends_of(node: Node, args: Sequence[Ends]) -> Ends:
    """Ends (boxes,) of a node from those of its arguments; of other kinds its own interval."""
    if node.kind not in _ENDS:
        return np.full_like(args[0][0], node.low), np.full_like(args[0][1], node.high)
    return _ENDS[node.kind](node, [*args])


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
    # 0 times infinity is 0.
    corners = [np.where((a == 0.0) | (b == 0.0), 0.0, a * b) for a in args[0] for b in args[1]]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _even_ends(x: FloatArray, y: FloatArray, crosses_zero: BoolArray) -> Ends:
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


#: Steps back to the values of a box that are tried, and most of these values.
DEPTHS = (1, 2, 3, 4, 6, 8)
MOST_VALUES = 8
#: Most boxes of several values, and of one value.
MOST_BOXES = 2_000
MOST_BOXES_OF_ONE = 20_000
POINTS = 256  #: Points at which a range is tried before boxes are.
LEAST = 2.0**-64  #: Smaller than the last bit of any condition of a selection.


def is_proven(node: Node, low: float, high: float) -> bool:
    """Whether boxes prove that a value is in a range; intervals of other claims are assumed."""
    if low <= node.low and node.high <= high:
        return True
    tried: set[frozenset[int]] = set()
    for depth, choose in product(DEPTHS, (max, min)):
        cut = list(_cut(node, depth, choose))
        numbers = frozenset(n.number for n in cut)
        if numbers in tried or len(cut) > MOST_VALUES:
            continue
        tried.add(numbers)
        finite = all(math.isfinite(n.high - n.low) for n in cut)
        if finite and _holds_on_boxes(_Function(node, cut), low, high):
            return True
    return False


def _cut(node: Node, depth: int, choose: Callable[[int, int], int]) -> Iterator[Node]:
    """Values that a node is computed from, ``depth`` steps back, without constants.

    Where paths of different lengths lead to a value, ``choose`` selects among the remaining steps
    of each: with `min`, both sides of ``x < a ? a : x`` end at x, however x is computed.
    """
    steps: dict[int, int] = {node.number: depth}
    nodes = {node.number: node}
    waiting = {node.number}
    while waiting:
        number = max(waiting)  # all readers of the latest node are done
        waiting.remove(number)
        current, remaining = nodes[number], steps[number]
        if current.kind == "const":
            continue
        if current.kind in LEAVES or (remaining <= 0 and number != node.number):
            yield current
            continue
        for arg in current.args:
            nodes[arg.number] = arg
            waiting.add(arg.number)
            steps[arg.number] = choose(steps.get(arg.number, remaining - 1), remaining - 1)


def _holds_on_boxes(function: _Function, low: float, high: float) -> bool:
    """Whether boxes, halved again and again, show that a function is between two limits."""
    cut = function.cut
    if not cut:
        return False
    ends = np.array([[n.low, n.high] for n in cut], dtype=np.float64)
    size = np.maximum(ends[:, 1] - ends[:, 0], 1e-300)
    boxes = _by_sign(ends[None], function)
    with np.errstate(all="ignore"):
        lower, upper = function(_points_in(boxes))
        if ((lower < low) | (upper > high)).any():  # no box with such a point is proven
            return False
        most, count = MOST_BOXES if len(cut) > 1 else MOST_BOXES_OF_ONE, 0
        while True:
            lower, upper = function(boxes)
            boxes = boxes[~((low <= lower) & (upper <= high))]
            if not len(boxes):
                return True
            count += 2 * len(boxes)
            middle, rows = boxes.mean(axis=2), np.arange(len(boxes))
            if count > most or (middle <= boxes[:, :, 0]).all(axis=1).any():
                return False
            widest = ((boxes[:, :, 1] - boxes[:, :, 0]) / size).argmax(axis=1)
            lower_half, upper_half = boxes.copy(), boxes.copy()
            lower_half[rows, widest, 1] = upper_half[rows, widest, 0] = middle[rows, widest]
            boxes = np.concatenate([lower_half, upper_half])


def _by_sign(boxes: FloatArray, function: _Function) -> FloatArray:
    """Split boxes at 0 along the values whose sign is the condition of a selection."""
    conditions = {n.args[0].number for n in function.order if n.kind == "select"}
    for k, node in enumerate(function.cut):
        crosses_zero = (boxes[:, k, 0] < 0.0) & (boxes[:, k, 1] > 0.0)
        if node.number in conditions and crosses_zero.any():
            lower, upper = boxes[crosses_zero], boxes[crosses_zero]
            lower[:, k, 1], upper[:, k, 0] = -LEAST, 0.0
            boxes = np.concatenate([boxes[~crosses_zero], lower, upper])
    return boxes


def _points_in(boxes: FloatArray) -> FloatArray:
    """Some corners and middles of boxes (boxes, values, 2), as boxes without size."""
    rng = np.random.default_rng(1)
    some = boxes[rng.integers(len(boxes), size=POINTS)]
    ends = np.concatenate([some, some.mean(axis=2, keepdims=True)], axis=2)
    choice = rng.integers(3, size=(*ends.shape[:2], 1))
    return np.repeat(np.take_along_axis(ends, choice, axis=2), 2, axis=2)


class _Function:
    """A node as a function of the nodes of a cut, on intervals."""

    def __init__(self, node: Node, cut: Sequence[Node]) -> None:
        self.node, self.cut = node, cut
        self.order: list[Node] = []
        visited = {n.number for n in cut}
        stack = [(node, False)]
        while stack:
            current, is_expanded = stack.pop()
            if is_expanded:
                self.order.append(current)
            elif current.number not in visited:
                visited.add(current.number)
                stack += [(current, True), *((arg, False) for arg in current.args)]

    def __call__(self, boxes: FloatArray) -> Ends:
        """Ends of the value on boxes (boxes, values, 2)."""
        ends: dict[int, Ends] = {
            n.number: (boxes[:, k, 0], boxes[:, k, 1]) for k, n in enumerate(self.cut)
        }
        for node in self.order:
            if node.kind == "const":
                constant = np.full(len(boxes), node.value)
                ends[node.number] = constant, constant
                continue
            args = [ends[arg.number] for arg in node.args]
            if node.kind == "sin" and (angle := node.args[0]).kind == "wrap" and angle.value == 2.0:
                args = [ends.get(angle.args[0].number, args[0])]  # the same sine, without the jump
            lower, upper = ends_of(node, args)
            ends[node.number] = np.maximum(lower, node.low), np.minimum(upper, node.high)
        return ends[self.node.number]
