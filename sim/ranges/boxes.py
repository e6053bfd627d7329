"""Proof of a range by intervals on boxes, each halved until it decides.

A value is a function of the values that it is computed from, some steps back, each anywhere in its
known interval. The interval of the function over the whole box may be too wide, because the same
value occurs twice or a selection is undecided. Then both halves of the box are tried. Products with
an inverse root use a relation that intervals cannot express: where S - k c^2 is a sum of squares,
|c| / sqrt(S) <= 1 / sqrt(k).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np

from boresight.model.lowering.graph import LEAVES, Node
from boresight.sim.ranges.claims import Claim
from boresight.sim.ranges.intervals import Ends, FloatArray, ends_of

#: Steps back to the values of a box that are tried, and most of these values.
DEPTHS = (1, 2, 3, 4, 6, 8)
MOST_VALUES = 8
#: Most boxes of several values, and of one value.
MOST_BOXES = 2_000
MOST_BOXES_OF_ONE = 20_000
#: Points at which a range is tried before boxes are.
POINTS = 256
#: Smaller than the last bit of any condition of a selection.
LEAST = 2.0**-64
#: Factors k for which S - k c^2 is tried.
FACTORS = (4.0, 2.0, 1.0)


def is_proven(claim: Claim) -> bool:
    """Whether intervals on boxes prove a claim; intervals of other claims are assumed."""
    low, high = claim.ends
    if low <= claim.node.low and claim.node.high <= high:
        return True
    tried: set[frozenset[int]] = set()
    for depth, choose in product(DEPTHS, (max, min)):
        cut = list(_cut(claim.node, depth, choose))
        numbers = frozenset(n.number for n in cut)
        if numbers in tried or len(cut) > MOST_VALUES:
            continue
        tried.add(numbers)
        finite = all(math.isfinite(n.high - n.low) for n in cut)
        if finite and _holds_on_boxes(_Function(claim.node, cut), low, high):
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
        self.bounds = {n.number: _largest_quotient(n) for n in self.order if n.kind == "mul"}

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
            bound = self.bounds.get(node.number, math.inf)
            ends[node.number] = (
                np.maximum(lower, max(node.low, -bound)),
                np.minimum(upper, min(node.high, bound)),
            )
        return ends[self.node.number]


def _largest_quotient(node: Node) -> float:
    """Largest |c| / sqrt(S) of a product with an inverse root; infinite for other products."""
    for c, root in (node.args, node.args[::-1]):
        if root.kind != "rsqrt" or (total := polynomial_of(root.args[0])) is None:
            continue
        cases = list(_signed_cases(c))
        if any(square is None for square, _ in cases):
            continue
        factors = [
            next((k for k in FACTORS if _dominates(total, square or {}, k, slack)), 0.0)
            for square, slack in cases
        ]
        if min(factors):
            return 1.0 / math.sqrt(min(factors))
    return math.inf


def _signed_cases(c: Node) -> Iterator[tuple[Polynomial | None, Polynomial | None]]:
    """Squares that c^2 may be, each with a polynomial that is at most 0 in that case."""
    if c.kind in ("abs", "flip"):
        yield from _signed_cases(c.args[-1])
    elif c.kind == "select":
        condition = polynomial_of(c.args[0])
        for branch, sign in ((c.args[1], 1.0), (c.args[2], -1.0)):
            yield _squared(branch), None if condition is None else scaled(condition, sign)
    else:
        yield _squared(c), None


def _squared(c: Node) -> Polynomial | None:
    form = polynomial_of(c)
    return None if form is None else times(form, form)


def _dominates(total: Polynomial, square: Polynomial, k: float, slack: Polynomial | None) -> bool:
    """Whether total - k square, or that plus ``slack``, is a sum of squares."""
    rest = plus(total, scaled(square, -k))
    return is_sum_of_squares(rest) or is_sum_of_squares(plus(rest, slack or {}))


#: Most terms of a polynomial, most steps back to the nodes that it is made of, and most products
#: of two terms.
TERMS = 60
STEPS_BACK = 6
PRODUCTS = 3600
#: A coefficient that rounding explains.
TINY = 1e-12
#: A polynomial: the coefficient of each product of nodes, by their sorted numbers.
Polynomial = dict[tuple[int, ...], float]


def polynomial_of(node: Node, depth: int = STEPS_BACK) -> Polynomial | None:
    """Expand a node, at most ``depth`` steps back; return None if it has too many terms."""
    if node.kind == "const":
        return {(): node.value}
    if not depth or node.kind not in ("bounded", "sum", "mul"):
        return {(node.number,): 1.0}
    if node.kind == "bounded":
        return polynomial_of(node.args[0], depth)
    parts = []
    for arg in node.args:
        part = polynomial_of(arg, depth - 1)
        if part is None:
            return None
        parts.append(part)
    if node.kind == "mul":
        return times(parts[0], parts[1])
    total: Polynomial = {}
    for part, sign in zip(parts, node.signs, strict=True):
        total = plus(total, scaled(part, sign))
    return total if len(total) <= TERMS else None


def times(a: Polynomial, b: Polynomial) -> Polynomial | None:
    """Return the product, or None if it has too many terms."""
    if len(a) * len(b) > PRODUCTS:
        return None
    product: Polynomial = {}
    for m, x in a.items():
        for n, y in b.items():
            key = tuple(sorted((*m, *n)))
            product[key] = product.get(key, 0.0) + x * y
    return product


def plus(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return the sum."""
    total = dict(a)
    for m, value in b.items():
        total[m] = total.get(m, 0.0) + value
    return total


def scaled(a: Polynomial, factor: float) -> Polynomial:
    """Return the product with a number."""
    return {m: factor * value for m, value in a.items()}


def is_sum_of_squares(a: Polynomial) -> bool:
    """Whether each term is a nonnegative multiple of a square, or zero but for rounding."""
    return all(
        value >= -TINY and (value <= TINY or all(m.count(n) % 2 == 0 for n in m))
        for m, value in a.items()
    )
