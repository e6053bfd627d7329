"""Vectors and their inner products at random points, and what values are made of them.

An identity of polynomials is checked at the points: of one that is false all of them would have to
be roots.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.boxes import Ends
from boresight.sim.ranges.steps import side_of

__all__ = [
    "CONDITIONS",
    "ONE",
    "POINTS",
    "Coefficient",
    "FloatArray",
    "Full",
    "Pair",
    "Sides",
    "Space",
    "Term",
    "Vector",
    "all_sides",
    "claim_chain",
    "coefficients_of",
    "conditions_in",
    "flat_parts",
    "is_choice",
    "is_scaled",
    "known_from",
    "of_unit",
]

FloatArray = npt.NDArray[np.float64]
#: Random points, and those that are tried first.
POINTS, _FIRST = 512, 32
#: Share of the terms by which an identity may fail at a point: rounding; most that terms count for
#: more than the product of the lengths.
_EXACT, _CANCELLED = 1e-12, 1e4
#: Vectors of one step; conditions of which all sides are tried.
_VECTORS, CONDITIONS = 900, 7
#: Steps back to what the ends of a coefficient follow from; conditions there, up to which each way
#: to give sides is tried; share of an interval by which another has to be nearer to be taken.
_BACK, _SIDES, _NEARER = 6, 3, 1e-3
#: Sides of conditions, by number: 1 negative, 2 not.
Sides = Mapping[int, int]


@dataclass(frozen=True)
class Coefficient:
    """A number times nodes where conditions have these sides, and 0 elsewhere."""

    number: float = 1.0
    nodes: tuple[Node, ...] = ()
    sides: frozenset[tuple[int, int]] = frozenset()

    def times(self, other: Coefficient) -> Coefficient:
        """The product; 0 where one condition would need both sides."""
        sides = self.sides | other.sides
        number = self.number * other.number
        if len({n for n, _ in sides}) < len(sides):
            number = 0.0
        return Coefficient(number, (*self.nodes, *other.nodes), sides)

    def ends(self, sides: Sides) -> tuple[float, float]:
        """Least and largest value on the given sides."""
        if any(sides.get(c, s) != s for c, s in self.sides):
            return 0.0, 0.0
        low = high = self.number
        for node, power in Counter(self.nodes).items():
            known = _known_ends(node, sides)
            least, most = known.low, known.high
            each = [least**power, most**power]
            if power % 2 == 0 and least < 0.0 < most:
                each.append(0.0)
            corners = [x * y if x and y else 0.0 for x in (low, high) for y in each]
            low, high = min(corners), max(corners)
        if any(c not in sides for c, _ in self.sides):
            low, high = min(low, 0.0), max(high, 0.0)
        return low, high

    def ends_in(self, cases: Mapping[int, Ends], sides: Sides) -> Ends:
        """Least and largest value (cases,) on the given sides, of nodes with these ends."""
        if any(sides.get(c, s) != s for c, s in self.sides):
            return np.zeros(1), np.zeros(1)
        low = high = np.full(1, self.number)
        for node in self.nodes:
            with np.errstate(invalid="ignore"):  # 0 times infinity
                corners = [
                    np.where((x == 0.0) | (y == 0.0), 0.0, x * y)
                    for x in (low, high)
                    for y in cases[_chosen(node, sides).number]
                ]
            low, high = np.minimum.reduce(corners), np.maximum.reduce(corners)
        if any(c not in sides for c, _ in self.sides):
            low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        return low, high


def _chosen(node: Node, sides: Sides) -> Node:
    """A node, or what its selections choose on the given sides."""
    while node.kind == "select" and (side := side_of(node.args[0], sides)):
        node = node.args[side]
    return node


@dataclass(eq=False)
class Vector:
    """One vector.

    Attributes
    ----------
    number : int
    at : (points, dimensions) array
    length : (points,) array
    parts : tuple of (Coefficient, Vector)
        Whose sum it is; less the part of that along ``unit``, if there is one.
    noise : tuple of Coefficient
        Whose sum is the square of what it has in a direction of its own.
    unit : Vector or None
    variance : Node or None
        The state that is its squared length, of a vector of the matrix before.
    measured : Vector or None
        Of a unit vector: along which one it is.
    share : bool
        It is shorter than one: sqrt(k) m of P - k (P h)(P h)^T, k = w / (w |m|^2 + v).
    """

    number: int
    at: FloatArray = field(repr=False)
    length: FloatArray = field(repr=False)
    parts: tuple[tuple[Coefficient, Vector], ...] = ()
    noise: tuple[Coefficient, ...] = ()
    unit: Vector | None = None
    variance: Node | None = None
    measured: Vector | None = None
    share: bool = False
    conditions: frozenset[int] = field(init=False)

    def __post_init__(self) -> None:
        self.conditions = frozenset(n for c in coefficients_of(self) for n, _ in c.sides).union(
            *(v.conditions for _, v in self.parts)
        )


def coefficients_of(v: Vector) -> Iterator[Coefficient]:
    """Of the vectors that one is the sum of, and of its noise."""
    yield from (c for c, _ in v.parts)
    yield from v.noise


Pair = tuple[Vector, Vector]
ONE = Coefficient()


@dataclass(frozen=True)
class Term:
    """A coefficient times inner products: none, one or two."""

    coefficient: Coefficient
    factors: tuple[Node, ...] = ()


class Space:
    """Vectors at the points, each once, and their inner products."""

    def __init__(self, dimensions: int) -> None:
        rng = np.random.default_rng(2)
        self.dimensions, self.used = dimensions, 0
        self.vectors: list[Vector] = []
        self.weights = rng.uniform(0.5, 1.5, _FIRST) * rng.choice([-1.0, 1.0], _FIRST)
        self.flat = np.zeros((16, _FIRST * dimensions))
        self.sums = np.zeros((16, dimensions))
        self.table = np.zeros((16, 16))

    def direction(self) -> int:
        """A direction that no vector has."""
        if self.used >= self.dimensions:
            raise Full
        self.used += 1
        return self.used - 1

    def add(self, at: FloatArray, **made: Any) -> Vector:
        """A vector (points, dimensions or fewer), or the one that is the same."""
        full = np.zeros((POINTS, self.dimensions))
        full[:, : at.shape[1]] = at
        first = full[:_FIRST]
        key, size = self.weights @ first, _lengths(full)
        count = len(self.vectors)
        scale = 1e-9 * (abs(self.weights) @ size[:_FIRST])
        for k in np.flatnonzero(abs(self.sums[:count] - key).max(axis=1) <= scale):
            if (abs(self.vectors[k].at - full).max(axis=1) <= 10.0 * _EXACT * size).all():
                return self.vectors[k]
        if count >= _VECTORS:
            raise Full
        if count == len(self.flat):
            self.flat = np.concatenate([self.flat, np.zeros_like(self.flat)])
            self.sums = np.concatenate([self.sums, np.zeros_like(self.sums)])
            table = np.zeros((2 * count, 2 * count))
            table[:count, :count] = self.table
            self.table = table
        vector = Vector(count, full, size, **made)
        self.vectors.append(vector)
        self.flat[count], self.sums[count] = first.ravel(), key
        products = self.flat[: count + 1] @ (self.weights[:, None] * first).ravel()
        self.table[count, : count + 1] = self.table[: count + 1, count] = products
        return vector

    def pairs(self, value: FloatArray, size: FloatArray, start: int) -> Iterator[Pair]:
        """Pairs whose inner product is a value, one of them from a number on."""
        count = len(self.vectors)
        if start >= count or not value.any():
            return
        key = self.weights @ value[:_FIRST]
        table = self.table[start:count, :count]
        scale = 1e-8 * (abs(self.weights) @ abs(value[:_FIRST]))
        for i, j in zip(*np.nonzero(abs(table - key) <= scale), strict=True):
            pair = self.vectors[start + i], self.vectors[j]
            if (j <= start + i) and self.is_pair(pair, value, size):
                yield pair

    @staticmethod
    def is_pair(pair: Pair, value: FloatArray, size: FloatArray) -> bool:
        """Whether an inner product is a value."""
        x, y = pair
        for part in (slice(_FIRST), slice(_FIRST, None)):
            off = abs(np.einsum("ij,ij->i", x.at[part], y.at[part]) - value[part])
            most = x.length[part] * y.length[part]
            if (off > _EXACT * (np.minimum(size[part], _CANCELLED * most) + most)).any():
                return False
        return True


def _lengths(at: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", at, at)))


class Full(Exception):
    """More vectors or directions than there is room for."""


def claim_chain(node: Node) -> Iterator[Node]:
    """A node, and what claims of it are of."""
    yield node
    while node.kind == "bounded":
        node = node.args[0]
        yield node


@dataclass(frozen=True)
class _Known:
    """Ends of a node, and the nodes from whose intervals they follow."""

    low: float
    high: float
    base: frozenset[Node]

    def within(self, node: Node) -> _Known:
        """These ends where they are well inside the interval of a node, else its own."""
        low, high = (min(max(end, node.low), node.high) for end in (self.low, self.high))
        least = _NEARER * max(abs(node.low), abs(node.high))
        nearer = (low > node.low + least, high < node.high - least)
        if not any(nearer):
            return _own(node)
        outside = self.low < node.low or self.high > node.high
        return _Known(low, high, self.base | {node} if outside else self.base)


def _own(node: Node) -> _Known:
    return _Known(node.low, node.high, frozenset({node}))


def _known_ends(node: Node, sides: Sides, left: int = _BACK) -> _Known:
    """Ends of a node, also as what a claim that is wider than needed is of, on the given sides.

    A constant where x is negative, else x, is not below both 0 and the constant.
    """
    if left == 0 or not node.args:
        return _own(node)
    return _ends_on(node, tuple((n, sides[n]) for n in _conditions_of(node) if n in sides), left)


@lru_cache(maxsize=2**17)
def _ends_on(node: Node, given: tuple[tuple[int, int], ...], left: int) -> _Known:
    """The same, of a node that is computed, on these sides of conditions."""
    sides = dict(given)
    if node.kind in ("bounded", "saturated"):
        return _known_ends(node.args[0], sides, left).within(node)
    if node.kind == "select" and (side := side_of(node.args[0], sides)):
        return _known_ends(node.args[side], sides, left - 1)
    if node.kind == "select" and node.args[0] is node.args[2] and node.args[1].kind == "const":
        own = _own(node)
        return replace(own, low=max(own.low, min(0.0, node.args[1].value)))
    if node.kind not in ("mul", "sum"):
        return _own(node)
    found = [_known_ends(arg, sides, left - 1) for arg in node.args]
    base = frozenset[Node]().union(*(each.base for each in found))
    if node.kind == "mul":
        a, b = ((each.low, each.high) for each in found)
        corners = [x * y if x and y else 0.0 for x in a for y in b]
        return _Known(min(corners), max(corners), base).within(node)
    low = high = 0.0
    for each, sign in zip(found, node.signs, strict=True):
        start, end = (each.low, each.high)[::sign]
        low, high = low + sign * start, high + sign * end
    return _Known(low, high, base).within(node)


def known_from(node: Node, sides: Sides | None = None) -> Iterator[Node]:
    """Nodes from whose intervals the known ends of a node follow.

    ``sides``: those that are given; None: whatever they are.
    """
    if sides is not None:
        yield from sorted(_known_ends(node, sides).base, key=lambda n: n.number)
        return
    conditions = sorted({*conditions_in(node)})
    if len(conditions) > _SIDES:
        yield from _made_of(node)
        return
    base = set[Node]()
    for each in product((0, 1, 2), repeat=len(conditions)):
        given = {n: s for n, s in zip(conditions, each, strict=True) if s}
        base |= _known_ends(node, given).base
    yield from sorted(base, key=lambda n: n.number)


def conditions_in(node: Node) -> Iterator[int]:
    """Conditions, by number, on whose sides the ends of a node may depend."""
    return (n.args[0].number for n in _made_of(node) if n.kind == "select")


@lru_cache(maxsize=2**14)
def _conditions_of(node: Node) -> tuple[int, ...]:
    """The same in order, each once, and those that they are made of."""
    stack = [n.args[0] for n in _made_of(node) if n.kind == "select"]
    found = set[int]()
    while stack:
        condition = stack.pop()
        if condition.number not in found:
            found.add(condition.number)
            stack += condition.args if condition.kind == "select" else ()
    return tuple(sorted(found))


def _made_of(node: Node) -> Iterator[Node]:
    """A node and those that its known ends are computed from."""
    left = {node.number: _BACK}
    stack = [node]
    while stack:
        node = stack.pop()
        yield node
        steps = left[node.number] - (node.kind not in ("bounded", "saturated"))
        if steps >= 0 and node.kind in ("bounded", "saturated", "mul", "select", "sum"):
            for arg in node.args[1:] if node.kind == "select" else node.args:
                if left.get(arg.number, -1) < steps:
                    left[arg.number] = steps
                    stack.append(arg)


def is_choice(c: Coefficient) -> bool:
    """Whether a coefficient is 0 or 1."""
    return c.number == 1.0 and not c.nodes


def is_scaled(v: Vector) -> bool:
    """Whether a vector is another one, times a coefficient."""
    return len(v.parts) == 1 and v.unit is None and not v.noise


def of_unit(v: Vector) -> bool:
    """Whether a vector is of length one, or zero."""
    if v.measured is not None:
        return True
    return is_scaled(v) and is_choice(v.parts[0][0]) and of_unit(v.parts[0][1])


def flat_parts(parts: Sequence[tuple[Coefficient, Vector]]) -> Iterator[tuple[Coefficient, Vector]]:
    """A sum of vectors, with what those are the sums of that are sums themselves."""
    for c, v in parts:
        if v.parts and v.unit is None and not v.noise:
            yield from flat_parts([(c.times(own), part) for own, part in v.parts])
        else:
            yield c, v


def all_sides(conditions: set[int] | frozenset[int]) -> Iterator[dict[int, int]]:
    """The sides of the first few conditions, in all ways."""
    chosen = sorted(conditions)[:CONDITIONS]
    for sides in product((1, 2), repeat=len(chosen)):
        yield dict(zip(chosen, sides, strict=True))
