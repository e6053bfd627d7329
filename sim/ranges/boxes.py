"""Proof of a range by intervals on boxes, each halved until it decides.

A value is a function of the values that it is computed from, some steps back, each anywhere in its
known interval. Where the interval of the function over the whole box is too wide, since the same
value occurs twice or a selection is undecided, both halves of the box are tried. Products with an
inverse root use a relation that intervals cannot express: where S - k c^2 is a sum of terms that
cannot be negative, |c| / sqrt(S) <= 1 / sqrt(k).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import LEAVES, Node
from boresight.model.words.program import Program
from boresight.sim.ranges.claims import Claim, Proof, live
from boresight.sim.ranges.intervals import Ends, ends_of
from boresight.sim.ranges.polynomials import (
    Polynomial,
    is_sum_of_squares,
    plus,
    polynomial_of,
    scaled,
    times,
)

__all__ = ["interval_at", "proof_of", "reached_cells"]

FloatArray = npt.NDArray[np.float64]
#: Steps back that are tried, most values that may vary; terms and steps back of a polynomial; most
#: boxes, and of one value.
_DEPTHS, _VARIABLES, _TERMS, _BACK = (1, 2, 3, 4, 6, 8, 12), 8, 60, 6
_BOXES, _BOXES_OF_ONE = 6_000, 100_000
#: Points where a range is tried first.
_POINTS = 256
#: Most cells of a state's range, and of the range of one other value.
_CELLS = 128
#: Less than the last bit of any condition of a selection.
_LEAST = 2.0**-64


def reached_cells(program: Program, nodes: Mapping[int, Node]) -> dict[int, FloatArray]:
    """Intervals (n, 2) of states that can be reached from their first value; by node number.

    The next value of such a state depends on few others, each anywhere in its range. The range is
    divided into cells, and cells that a reached one leads to are reached, selection by selection.
    Only states that do not reach all of their cells are included.
    """
    out = {}
    for state, next_state in program.states:
        node, next_node = nodes.get(state), nodes.get(next_state)
        if node is None or next_node is None or not math.isfinite(next_node.high - next_node.low):
            continue
        cut = [n for n in live([next_node]) if n.kind in LEAVES and n.kind != "const"]
        if node in cut and len(cut) <= _VARIABLES and len(cut) > 1:
            form = program.format(state)
            initial = float(form.real(program.values[state].initial))
            candidates = [
                cells
                for other in cut
                if other is not node
                and math.isfinite(other.high - other.low)
                and (cells := _cells(node, next_node, cut, other, initial, form.lsb)) is not None
            ]
            if candidates:
                out[node.number] = min(candidates, key=lambda c: float((c[:, 1] - c[:, 0]).sum()))
    return out


def _cells(
    node: Node, next_node: Node, cut: Sequence[Node], other: Node, initial: float, lsb: float
) -> FloatArray | None:
    """Reached intervals of a state, with boxes along ``other``; None: its whole range."""
    size = 2.0 ** math.ceil(math.log2((node.high - node.low) / _CELLS))
    edges = np.arange(math.floor(node.low / size), math.ceil(node.high / size) + 1) * size
    cells = np.stack([edges[:-1], edges[1:] - lsb], axis=1)
    halves = [(other.low, -_LEAST), (0.0, other.high)]
    spans = halves if other.low < 0.0 < other.high else [(other.low, other.high)]
    other_boxes = np.concatenate([_divided(*span, _CELLS // len(spans)) for span in spans])
    function = _Function(next_node, cut)
    reached = (cells[:, 0] <= initial) & (initial <= cells[:, 1])
    frontier = reached
    while frontier.any():
        frontier_cells = cells[frontier]
        boxes = np.empty((len(frontier_cells) * _CELLS, len(cut), 2))
        for k, n in enumerate(cut):
            boxes[:, k] = n.low, n.high
            if n is node:
                boxes[:, k] = np.repeat(frontier_cells, _CELLS, axis=0)
            elif n is other:
                boxes[:, k] = np.tile(other_boxes, (len(frontier_cells), 1))
        boxes = _by_sign(boxes, function, cut)
        successors = np.zeros_like(reached)
        with np.errstate(all="ignore"):
            for lower, upper in _alternatives(function, boxes, next_node, {}):
                successors |= (
                    (cells[:, 0] <= upper[:, None] + 0.5 * lsb)
                    & (lower[:, None] <= cells[:, 1] + 0.5 * lsb)
                ).any(axis=0)
        frontier = successors & ~reached
        reached = reached | successors
    if reached.all() or not reached.any():
        return None
    transitions = np.flatnonzero(np.diff(np.concatenate([[0], reached.astype(int), [0]])))
    ends = np.stack([cells[transitions[::2], 0], cells[transitions[1::2] - 1, 1]], axis=1)
    return np.asarray(np.clip(ends, node.low, node.high))


def _divided(low: float, high: float, count: int) -> FloatArray:
    """Equal intervals (count, 2)."""
    edges = np.linspace(low, high, count + 1)
    return np.stack([edges[:-1], edges[1:]], axis=1)


def _by_sign(boxes: FloatArray, function: _Function, cut: Sequence[Node]) -> FloatArray:
    """Boxes split at 0 along the values of a cut whose sign is the condition of a selection."""
    conditions = {n.args[0].number for n in function.order if n.kind == "select"}
    for k, n in enumerate(cut):
        crosses_zero = (boxes[:, k, 0] < 0.0) & (boxes[:, k, 1] > 0.0)
        if n.number in conditions and crosses_zero.any():
            lower, upper = boxes[crosses_zero], boxes[crosses_zero]
            lower[:, k, 1], upper[:, k, 0] = -_LEAST, 0.0
            boxes = np.concatenate([boxes[~crosses_zero], lower, upper])
    return boxes


def _alternatives(
    function: _Function, boxes: FloatArray, node: Node, sides: dict[int, int]
) -> Iterator[Ends]:
    """Ends of each branch that the last selections of a computation may choose."""
    values = function.values(boxes, sides)
    if node.kind == "bounded" and node.number not in function.cut:
        yield from _alternatives(function, boxes, node.args[0], sides)
    elif node.kind == "select" and node.number not in function.cut:
        condition = node.args[0].number
        lower, upper = values[condition]
        for side, is_possible in ((1, lower < 0.0), (2, upper >= 0.0)):
            if is_possible.any():
                choices = {**sides, condition: side}
                yield from _alternatives(function, boxes[is_possible], node.args[side], choices)
    else:
        yield values[node.number]


def proof_of(
    claim: Claim,
    reached: Mapping[int, FloatArray] | None = None,
    relations: dict[int, float] | None = None,
) -> Proof | None:
    """Prove a claim, if intervals on boxes decide it.

    ``reached`` is the result of `reached_cells`; ``relations`` caches the bounds of products, by
    number, for the next claim of the same step.
    """
    low, high = claim.ends
    if claim.holds(claim.node.low, claim.node.high):
        return Proof("interval", (claim.node,))
    visited = {frozenset[int]()}
    for depth, choose in product(_DEPTHS, (max, min)):
        cut = list(_cut(claim.node, depth, choose))
        numbers = frozenset(n.number for n in cut)
        if numbers in visited:
            continue
        visited.add(numbers)
        if len(cut) > _VARIABLES or not all(math.isfinite(n.high - n.low) for n in cut):
            continue
        function = _Function(claim.node, cut, relations)
        boxes = _count_boxes(function, cut, low, high, reached or {})
        if boxes:
            return Proof(f"{boxes} boxes of {len(cut)} values", (*cut, *function.order))
    return None


def interval_at(node: Node, cut: Sequence[Node], value: float) -> tuple[float, float]:
    """Ends of a node where all values of the cut are equal to one number."""
    with np.errstate(all="ignore"):
        lower, upper = _Function(node, cut)(np.full((1, len(cut), 2), value))
    return float(lower[0]), float(upper[0])


def _cut(node: Node, depth: int, choose: Callable[[int, int], int]) -> Iterator[Node]:
    """Values that a node is computed from, ``depth`` steps back, constants left out.

    Where paths of different lengths lead to a value, ``choose`` selects among the remaining steps
    of each: with `min`, both sides of ``x < a ? a : x`` end at x, however x is computed.
    """
    steps: dict[int, int] = {node.number: depth}
    nodes = {node.number: node}
    order = [node.number]
    while order:  # the latest node first: all its readers are done
        number = max(order)
        order.remove(number)
        current, remaining = nodes[number], steps[number]
        if current.kind == "const":
            continue
        if current.kind in LEAVES or (remaining <= 0 and number != node.number):
            yield current
            continue
        for arg in current.args:
            if arg.number not in steps:
                order.append(arg.number)
            nodes[arg.number] = arg
            steps[arg.number] = choose(steps.get(arg.number, remaining - 1), remaining - 1)


def _count_boxes(
    function: _Function,
    cut: Sequence[Node],
    low: float,
    high: float,
    reached: Mapping[int, FloatArray],
) -> int:
    """Number of boxes that prove the range; 0: too many."""
    boxes, count = np.array([[[n.low, n.high] for n in cut]]).reshape(1, len(cut), 2), 0
    size = np.maximum(boxes[0, :, 1] - boxes[0, :, 0], 1e-300)
    for k, n in enumerate(cut):
        if n.number in reached:
            cells = reached[n.number]
            boxes = np.repeat(boxes, len(cells), axis=0)
            boxes[:, k] = np.tile(cells, (len(boxes) // len(cells), 1))
    boxes = _by_sign(boxes, function, cut)
    limit = (_BOXES if len(cut) > 1 else _BOXES_OF_ONE) if cut else 0
    with np.errstate(all="ignore"):
        lower, upper = function(_points_in(boxes))
    if ((lower < low) | (upper > high)).any():  # no box with such a point is proven
        return 0
    while True:
        with np.errstate(all="ignore"):
            lower, upper = function(boxes)
        boxes = boxes[~((low <= lower) & (upper <= high))]
        if not len(boxes):
            return count + 1
        count += 2 * len(boxes)
        middle, rows = boxes.mean(axis=2), np.arange(len(boxes))
        if count > limit or (middle <= boxes[:, :, 0]).all(axis=1).any():
            return 0
        widest = ((boxes[:, :, 1] - boxes[:, :, 0]) / size).argmax(axis=1)
        lower_half, upper_half = boxes.copy(), boxes.copy()
        lower_half[rows, widest, 1] = upper_half[rows, widest, 0] = middle[rows, widest]
        boxes = np.concatenate([lower_half, upper_half])


def _points_in(boxes: FloatArray) -> FloatArray:
    """Corners and middles of boxes (boxes, cut, 2), some of them, as boxes without size."""
    rng = np.random.default_rng(1)
    sample = boxes[rng.integers(len(boxes), size=_POINTS)]
    ends = np.concatenate([sample, sample.mean(axis=2, keepdims=True)], axis=2)
    choice = rng.integers(3, size=(*ends.shape[:2], 1))
    return np.repeat(np.take_along_axis(ends, choice, axis=2), 2, axis=2)


class _Function:
    """A node as a function of the nodes of a cut, on intervals."""

    def __init__(
        self, node: Node, cut: Sequence[Node], relations: dict[int, float] | None = None
    ) -> None:
        self.node, self.cut = node, {n.number: k for k, n in enumerate(cut)}
        self.order: list[Node] = []
        visited = set(self.cut)
        stack = [(node, False)] if node.number not in visited else []
        while stack:
            current, is_expanded = stack.pop()
            if is_expanded:
                self.order.append(current)
            elif current.number not in visited:
                visited.add(current.number)
                stack += [(current, True), *((arg, False) for arg in current.args)]
        self.bounds = {} if relations is None else relations
        for n in self.order:
            if n.kind == "mul" and n.number not in self.bounds:
                self.bounds[n.number] = self._relation(n)

    def __call__(self, boxes: FloatArray) -> Ends:
        """Ends of the value on boxes (boxes, cut, 2)."""
        return self.values(boxes)[self.node.number]

    def values(self, boxes: FloatArray, sides: Mapping[int, int] | None = None) -> dict[int, Ends]:
        """Ends of all values computed between the cut and the node, by number.

        ``sides``: the side (1 where it is negative, else 2) that a condition chooses everywhere.
        """
        sides = sides or {}
        ends: dict[int, Ends] = {
            number: (boxes[:, k, 0], boxes[:, k, 1]) for number, k in self.cut.items()
        }
        for node in self.order:
            args = [ends[arg.number] for arg in node.args]
            if node.kind == "sin" and (angle := node.args[0]).kind == "wrap" and angle.value == 2.0:
                args = [ends.get(angle.args[0].number, args[0])]  # the same, without the jump
            lower, upper = ends_of(node, args) if node.kind != "const" else (node.value, node.value)
            if node.kind == "select" and node.args[0].number in sides:
                lower, upper = args[sides[node.args[0].number]]
            lower, upper = np.maximum(lower, node.low), np.minimum(upper, node.high)
            if (bound := self.bounds.get(node.number, math.inf)) < math.inf:
                lower, upper = np.maximum(lower, -bound), np.minimum(upper, bound)
            if np.shape(lower) != (len(boxes),) or np.shape(upper) != (len(boxes),):
                lower, upper = (np.broadcast_to(end, (len(boxes),)) for end in (lower, upper))
            ends[node.number] = lower, upper
        return ends

    def _relation(self, node: Node) -> float:
        """Largest |c| / sqrt(S), by the relation above; infinite of another product."""
        for c, root in (node.args, node.args[::-1]):
            if root.kind != "rsqrt":
                continue
            total = polynomial_of(root.args[0], _TERMS, _BACK)
            sides = list(_signed_cases(c))
            if total is None or any(side is None for side, _ in sides):
                continue
            factors = [
                max((k for k in (1.0, 2.0, 4.0) if _dominates(total, side, k, slack)), default=0.0)
                for side, slack in sides
            ]
            if min(factors):
                return 1.0 / math.sqrt(min(factors))
        return math.inf


def _signed_cases(c: Node) -> Iterator[tuple[Polynomial | None, Polynomial | None]]:
    """Squares that c^2 may be, each with a polynomial that is at most 0 in that case."""
    if c.kind in ("abs", "flip"):
        yield from _signed_cases(c.args[-1])
    elif c.kind == "select":
        condition = polynomial_of(c.args[0], _TERMS, _BACK)
        for branch, sign in ((c.args[1], 1.0), (c.args[2], -1.0)):
            slack = None if condition is None else scaled(condition, sign)
            yield _squared(branch), slack
    else:
        yield _squared(c), None


def _squared(c: Node) -> Polynomial | None:
    factor = polynomial_of(c, _TERMS, _BACK)
    return None if factor is None else times(factor, factor, _TERMS)


def _dominates(
    total: Polynomial, square: Polynomial | None, k: float, slack: Polynomial | None
) -> bool:
    """Whether total - k square, or that plus ``slack``, is a sum of nonnegative terms."""
    assert square is not None
    for extra in (None, slack):
        rest = plus(plus(total, scaled(square, -k)), extra or {})
        if is_sum_of_squares(rest):
            return True
    return False
