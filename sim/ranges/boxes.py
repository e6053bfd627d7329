"""Proof of a range by intervals on boxes that are halved where they do not decide.

A value is a function of the values that it is computed from, some steps back, each anywhere in the
interval that is known of it. Where the interval of the function over the whole box is too wide,
since the same value occurs twice or a selection is undecided, both halves of the box are tried.
Products with an inverse root use a relation that no interval holds: where S - k c^2 is a sum of
what cannot be negative, |c| / sqrt(S) <= 1 / sqrt(k).
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
#: Cells of a state's range, at most, and of one other's.
_CELLS = 128
#: Less than the last bit of what a selection compares with 0.
_LEAST = 2.0**-64


def reached_cells(program: Program, nodes: Mapping[int, Node]) -> dict[int, FloatArray]:
    """Intervals (n, 2) of states that can be reached from their first value; by node number.

    Of a state whose next value depends on few others, each anywhere in its range: the range is
    divided into cells, and those that a reached one leads to are reached, selection by selection.
    Only states of which that leaves something out.
    """
    out = {}
    for state, following in program.states:
        node, after = nodes.get(state), nodes.get(following)
        if node is None or after is None or not math.isfinite(after.high - after.low):
            continue
        cut = [n for n in live([after]) if n.kind in LEAVES and n.kind != "const"]
        if node in cut and len(cut) <= _VARIABLES and len(cut) > 1:
            form = program.format(state)
            first = float(form.real(program.values[state].initial))
            found = [
                cells
                for other in cut
                if other is not node
                and math.isfinite(other.high - other.low)
                and (cells := _cells(node, after, cut, other, first, form.lsb)) is not None
            ]
            if found:
                out[node.number] = min(found, key=lambda c: float((c[:, 1] - c[:, 0]).sum()))
    return out


def _cells(
    node: Node, after: Node, cut: Sequence[Node], other: Node, first: float, lsb: float
) -> FloatArray | None:
    """Reached intervals of a state, with boxes along ``other``; None: its whole range."""
    size = 2.0 ** math.ceil(math.log2((node.high - node.low) / _CELLS))
    edges = np.arange(math.floor(node.low / size), math.ceil(node.high / size) + 1) * size
    cells = np.stack([edges[:-1], edges[1:] - lsb], axis=1)
    both = [(other.low, -_LEAST), (0.0, other.high)]
    spans = both if other.low < 0.0 < other.high else [(other.low, other.high)]
    parts = np.concatenate([_divided(*span, _CELLS // len(spans)) for span in spans])
    function = _Function(after, cut)
    known = (cells[:, 0] <= first) & (first <= cells[:, 1])
    new = known
    while new.any():
        chosen = cells[new]
        boxes = np.empty((len(chosen) * _CELLS, len(cut), 2))
        for k, n in enumerate(cut):
            boxes[:, k] = n.low, n.high
            if n is node:
                boxes[:, k] = np.repeat(chosen, _CELLS, axis=0)
            elif n is other:
                boxes[:, k] = np.tile(parts, (len(chosen), 1))
        boxes = _by_sign(boxes, function, cut)
        led = np.zeros_like(known)
        with np.errstate(all="ignore"):
            for least, most in _alternatives(function, boxes, after, {}):
                led |= (
                    (cells[:, 0] <= most[:, None] + 0.5 * lsb)
                    & (least[:, None] <= cells[:, 1] + 0.5 * lsb)
                ).any(axis=0)
        new = led & ~known
        known = known | led
    if known.all() or not known.any():
        return None
    steps = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(int), [0]])))
    ends = np.stack([cells[steps[::2], 0], cells[steps[1::2] - 1, 1]], axis=1)
    return np.asarray(np.clip(ends, node.low, node.high))


def _divided(low: float, high: float, count: int) -> FloatArray:
    """Equal intervals (count, 2)."""
    edges = np.linspace(low, high, count + 1)
    return np.stack([edges[:-1], edges[1:]], axis=1)


def _by_sign(boxes: FloatArray, function: _Function, cut: Sequence[Node]) -> FloatArray:
    """Boxes parted at 0 along the values of a cut whose sign is the condition of a selection."""
    deciding = {n.args[0].number for n in function.order if n.kind == "select"}
    for k, n in enumerate(cut):
        through = (boxes[:, k, 0] < 0.0) & (boxes[:, k, 1] > 0.0)
        if n.number in deciding and through.any():
            lower, upper = boxes[through], boxes[through]
            lower[:, k, 1], upper[:, k, 0] = -_LEAST, 0.0
            boxes = np.concatenate([boxes[~through], lower, upper])
    return boxes


def _alternatives(
    function: _Function, boxes: FloatArray, node: Node, sides: dict[int, int]
) -> Iterator[Ends]:
    """Ends of what the selections at the end of a computation choose, where they may."""
    values = function.values(boxes, sides)
    if node.kind == "bounded" and node.number not in function.cut:
        yield from _alternatives(function, boxes, node.args[0], sides)
    elif node.kind == "select" and node.number not in function.cut:
        condition = node.args[0].number
        least, most = values[condition]
        for side, possible in ((1, least < 0.0), (2, most >= 0.0)):
            if possible.any():
                chosen = {**sides, condition: side}
                yield from _alternatives(function, boxes[possible], node.args[side], chosen)
    else:
        yield values[node.number]


def proof_of(
    claim: Claim,
    reached: Mapping[int, FloatArray] | None = None,
    relations: dict[int, float] | None = None,
) -> Proof | None:
    """Prove a claim, if intervals on boxes decide it.

    ``reached`` is as `reached_cells` gives it; ``relations`` keeps what is found of products, by
    number, for the next claim of the same step.
    """
    low, high = claim.ends
    if claim.holds(claim.node.low, claim.node.high):
        return Proof("interval", (claim.node,))
    tried = {frozenset[int]()}
    for depth, steps in product(_DEPTHS, (max, min)):
        cut = list(_cut(claim.node, depth, steps))
        numbers = frozenset(n.number for n in cut)
        if numbers in tried:
            continue
        tried.add(numbers)
        if len(cut) > _VARIABLES or not all(math.isfinite(n.high - n.low) for n in cut):
            continue
        function = _Function(claim.node, cut, relations)
        boxes = _halved(function, cut, low, high, reached or {})
        if boxes:
            return Proof(f"{boxes} boxes of {len(cut)} values", (*cut, *function.order))
    return None


def interval_at(node: Node, cut: Sequence[Node], value: float) -> tuple[float, float]:
    """Ends of a node where all that it is computed from has one value."""
    with np.errstate(all="ignore"):
        least, most = _Function(node, cut)(np.full((1, len(cut), 2), value))
    return float(least[0]), float(most[0])


def _cut(node: Node, depth: int, steps: Callable[[int, int], int]) -> Iterator[Node]:
    """Values that a node is computed from, ``depth`` steps back, constants left out.

    Where paths of different lengths lead to a value, ``steps`` chooses from the steps that are left
    on each: with `min`, both sides of ``x < a ? a : x`` end at x, however x is computed.
    """
    level: dict[int, int] = {node.number: depth}
    nodes = {node.number: node}
    order = [node.number]
    while order:  # the latest node first: all that read it are done
        number = max(order)
        order.remove(number)
        at, left = nodes[number], level[number]
        if at.kind == "const":
            continue
        if at.kind in LEAVES or (left <= 0 and number != node.number):
            yield at
            continue
        for arg in at.args:
            if arg.number not in level:
                order.append(arg.number)
            nodes[arg.number] = arg
            level[arg.number] = steps(level.get(arg.number, left - 1), left - 1)


def _halved(
    function: _Function,
    cut: Sequence[Node],
    low: float,
    high: float,
    reached: Mapping[int, FloatArray],
) -> int:
    """Boxes that prove the range; 0: too many."""
    boxes, done = np.array([[[n.low, n.high] for n in cut]]).reshape(1, len(cut), 2), 0
    size = np.maximum(boxes[0, :, 1] - boxes[0, :, 0], 1e-300)
    for k, n in enumerate(cut):
        if n.number in reached:
            cells = reached[n.number]
            boxes = np.repeat(boxes, len(cells), axis=0)
            boxes[:, k] = np.tile(cells, (len(boxes) // len(cells), 1))
    boxes = _by_sign(boxes, function, cut)
    allowed = (_BOXES if len(cut) > 1 else _BOXES_OF_ONE) if cut else 0
    with np.errstate(all="ignore"):
        least, most = function(_points_in(boxes))
    if ((least < low) | (most > high)).any():  # nor is a box proven that has such a point
        return 0
    while True:
        with np.errstate(all="ignore"):
            least, most = function(boxes)
        boxes = boxes[~((low <= least) & (most <= high))]
        if not len(boxes):
            return done + 1
        done += 2 * len(boxes)
        middle, each = boxes.mean(axis=2), np.arange(len(boxes))
        if done > allowed or (middle <= boxes[:, :, 0]).all(axis=1).any():
            return 0
        which = ((boxes[:, :, 1] - boxes[:, :, 0]) / size).argmax(axis=1)
        lower, upper = boxes.copy(), boxes.copy()
        lower[each, which, 1] = upper[each, which, 0] = middle[each, which]
        boxes = np.concatenate([lower, upper])


def _points_in(boxes: FloatArray) -> FloatArray:
    """Corners and middles of boxes (boxes, cut, 2), some of them, as boxes without size."""
    rng = np.random.default_rng(1)
    chosen = boxes[rng.integers(len(boxes), size=_POINTS)]
    ends = np.concatenate([chosen, chosen.mean(axis=2, keepdims=True)], axis=2)
    which = rng.integers(3, size=(*ends.shape[:2], 1))
    return np.repeat(np.take_along_axis(ends, which, axis=2), 2, axis=2)


class _Function:
    """A node as a function of the nodes of a cut, on intervals."""

    def __init__(
        self, node: Node, cut: Sequence[Node], relations: dict[int, float] | None = None
    ) -> None:
        self.node, self.cut = node, {n.number: k for k, n in enumerate(cut)}
        self.order: list[Node] = []
        seen = set(self.cut)
        stack = [(node, False)] if node.number not in seen else []
        while stack:
            at, entered = stack.pop()
            if entered:
                self.order.append(at)
            elif at.number not in seen:
                seen.add(at.number)
                stack += [(at, True), *((arg, False) for arg in at.args)]
        self.bounds = {} if relations is None else relations
        for n in self.order:
            if n.kind == "mul" and n.number not in self.bounds:
                self.bounds[n.number] = self._relation(n)

    def __call__(self, boxes: FloatArray) -> Ends:
        """Ends of the value on boxes (boxes, cut, 2)."""
        return self.values(boxes)[self.node.number]

    def values(self, boxes: FloatArray, sides: Mapping[int, int] | None = None) -> dict[int, Ends]:
        """Ends of all values on the way, by number.

        ``sides``: the side (1 where it is negative, else 2) that a condition chooses everywhere.
        """
        sides = sides or {}
        known: dict[int, Ends] = {
            number: (boxes[:, k, 0], boxes[:, k, 1]) for number, k in self.cut.items()
        }
        for at in self.order:
            args = [known[arg.number] for arg in at.args]
            if at.kind == "sin" and (turned := at.args[0]).kind == "wrap" and turned.value == 2.0:
                args = [known.get(turned.args[0].number, args[0])]  # the same, without the jump
            least, most = ends_of(at, args) if at.kind != "const" else (at.value, at.value)
            if at.kind == "select" and at.args[0].number in sides:
                least, most = args[sides[at.args[0].number]]
            least, most = np.maximum(least, at.low), np.minimum(most, at.high)
            if (bound := self.bounds.get(at.number, math.inf)) < math.inf:
                least, most = np.maximum(least, -bound), np.minimum(most, bound)
            if np.shape(least) != (len(boxes),) or np.shape(most) != (len(boxes),):
                least, most = (np.broadcast_to(end, (len(boxes),)) for end in (least, most))
            known[at.number] = least, most
        return known

    def _relation(self, at: Node) -> float:
        """Largest |c| / sqrt(S) of a product that is one, by the relation above."""
        for c, root in (at.args, at.args[::-1]):
            if root.kind != "rsqrt":
                continue
            total = polynomial_of(root.args[0], _TERMS, _BACK)
            sides = list(_signed_cases(c))
            if total is None or any(side is None for side, _ in sides):
                continue
            best = [
                max((k for k in (1.0, 2.0, 4.0) if _no_less(total, side, k, less)), default=0.0)
                for side, less in sides
            ]
            if min(best):
                return 1.0 / math.sqrt(min(best))
        return math.inf


def _signed_cases(c: Node) -> Iterator[tuple[Polynomial | None, Polynomial | None]]:
    """Squares that c^2 may be, each with a polynomial that is at most 0 then."""
    if c.kind in ("abs", "flip"):
        yield from _signed_cases(c.args[-1])
    elif c.kind == "select":
        decides = polynomial_of(c.args[0], _TERMS, _BACK)
        for chosen, sign in ((c.args[1], 1.0), (c.args[2], -1.0)):
            less = None if decides is None else scaled(decides, sign)
            yield _squared(chosen), less
    else:
        yield _squared(c), None


def _squared(c: Node) -> Polynomial | None:
    factor = polynomial_of(c, _TERMS, _BACK)
    return None if factor is None else times(factor, factor, _TERMS)


def _no_less(
    total: Polynomial, square: Polynomial | None, k: float, less: Polynomial | None
) -> bool:
    """Whether total - k square, or that plus ``less``, is a sum of what cannot be negative."""
    assert square is not None
    for extra in (None, less):
        rest = plus(plus(total, scaled(square, -k)), extra or {})
        if is_sum_of_squares(rest):
            return True
    return False
