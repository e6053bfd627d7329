"""Coefficients of vectors: numbers times nodes on some sides of conditions, and their ends."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.intervals import Ends, product_of
from boresight.sim.ranges.polynomials import Polynomial, ends_of_product, polynomial_of
from boresight.sim.ranges.polynomials import times as multiplied
from boresight.sim.ranges.steps import side_of

__all__ = [
    "CONDITIONS",
    "ONE",
    "Coefficient",
    "Sides",
    "all_sides",
    "conditions_in",
    "ends_of_sum",
    "known_from",
    "nodes_behind",
]

#: Conditions of which all sides are tried.
CONDITIONS = 7
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

    @property
    def is_choice(self) -> bool:
        """Whether it is 0 or 1."""
        return self.number == 1.0 and not self.nodes

    @property
    def root(self) -> Coefficient | None:
        """The square root, if it is a number or a product of squares; None: it is another."""
        squares = [n.args[0] for n in self.nodes if n.kind == "mul" and n.args[0] is n.args[1]]
        if self.number < 0.0 or len(squares) < len(self.nodes):
            return None
        return Coefficient(math.sqrt(self.number), tuple(squares), self.sides)

    def polynomial(self, terms: int, left: int, ends: Container[int] = ()) -> Polynomial | None:
        """The coefficient as a polynomial (`polynomials.polynomial_of`), whatever its sides."""
        form: Polynomial | None = {(): self.number}
        for node in self.nodes:
            by = polynomial_of(node, terms, left, ends)
            form = None if form is None or by is None else multiplied(form, by, terms)
        return form

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
            low, high = ends_of_product((low, high), (known.low, known.high), power)
        if any(c not in sides for c, _ in self.sides):
            low, high = min(low, 0.0), max(high, 0.0)
        return low, high

    def ends_in(self, cases: Mapping[int, Ends], sides: Sides) -> Ends:
        """Least and largest value (cases,) on the given sides, of nodes with these ends."""
        if any(sides.get(c, s) != s for c, s in self.sides):
            return np.zeros(1), np.zeros(1)
        low = high = np.full(1, self.number)
        with np.errstate(invalid="ignore"):  # 0 times infinity
            for node in self.nodes:
                low, high = product_of((low, high), cases[_chosen(node, sides).number])
        if any(c not in sides for c, _ in self.sides):
            low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        return low, high


ONE = Coefficient()


def _chosen(node: Node, sides: Sides) -> Node:
    """A node, or what its selections choose on the given sides."""
    while node.kind == "select" and (side := side_of(node.args[0], sides)):
        node = node.args[side]
    return node


def ends_of_sum(coefficients: Iterable[Coefficient], sides: Sides) -> tuple[float, float]:
    """Least and largest value of a sum of coefficients on the given sides."""
    low = high = 0.0
    for c in coefficients:
        least, most = c.ends(sides)
        low, high = low + least, high + most
    return low, high


def nodes_behind(coefficients: Iterable[Coefficient]) -> set[Node]:
    """Nodes from whose intervals the ends of coefficients follow, on any sides."""
    return {known for c in coefficients for node in c.nodes for known in known_from(node)}


def all_sides(conditions: set[int] | frozenset[int]) -> Iterator[dict[int, int]]:
    """The sides of the first few conditions, in all ways."""
    chosen = sorted(conditions)[:CONDITIONS]
    for sides in product((1, 2), repeat=len(chosen)):
        yield dict(zip(chosen, sides, strict=True))


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
        one, other = ((each.low, each.high) for each in found)
        low, high = ends_of_product(one, other)
        return _Known(low, high, base).within(node)
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
