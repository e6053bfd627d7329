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
    "nodes_behind",
    "sources_of",
]

#: Conditions of which all sides are tried.
CONDITIONS = 7
#: Steps back from a coefficient to the nodes that decide its ends; most conditions there of which
#: all sides are tried; share of an interval by which another has to be narrower to replace it.
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
        """The square root of a number or a product of squares; None: of another form."""
        squares = [n.args[0] for n in self.nodes if n.kind == "mul" and n.args[0] is n.args[1]]
        if self.number < 0.0 or len(squares) < len(self.nodes):
            return None
        return Coefficient(math.sqrt(self.number), tuple(squares), self.sides)

    def polynomial(self, terms: int, depth: int, ends: Container[int] = ()) -> Polynomial | None:
        """The coefficient as a polynomial (`polynomials.polynomial_of`), whatever its sides."""
        form: Polynomial | None = {(): self.number}
        for node in self.nodes:
            factor = polynomial_of(node, terms, depth, ends)
            form = None if form is None or factor is None else multiplied(form, factor, terms)
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
            derived = _derived_ends(node, sides)
            low, high = ends_of_product((low, high), (derived.low, derived.high), power)
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
                low, high = product_of((low, high), cases[_selected(node, sides).number])
        if any(c not in sides for c, _ in self.sides):
            low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        return low, high


ONE = Coefficient()


def _selected(node: Node, sides: Sides) -> Node:
    """A node, or the argument that its selections choose on the given sides."""
    while node.kind == "select" and (side := side_of(node.args[0], sides)):
        node = node.args[side]
    return node


def ends_of_sum(coefficients: Iterable[Coefficient], sides: Sides) -> tuple[float, float]:
    """Least and largest value of a sum of coefficients on the given sides."""
    low = high = 0.0
    for c in coefficients:
        lower, upper = c.ends(sides)
        low, high = low + lower, high + upper
    return low, high


def nodes_behind(coefficients: Iterable[Coefficient]) -> set[Node]:
    """Nodes from whose intervals the ends of coefficients follow, on any sides."""
    return {source for c in coefficients for node in c.nodes for source in sources_of(node)}


def all_sides(conditions: set[int] | frozenset[int]) -> Iterator[dict[int, int]]:
    """The sides of the first few conditions, in all ways."""
    chosen = sorted(conditions)[:CONDITIONS]
    for sides in product((1, 2), repeat=len(chosen)):
        yield dict(zip(chosen, sides, strict=True))


@dataclass(frozen=True)
class _DerivedEnds:
    """Ends of a node, and the nodes from whose intervals they follow."""

    low: float
    high: float
    base: frozenset[Node]

    def within(self, node: Node) -> _DerivedEnds:
        """These ends where they are well inside the interval of a node, else the interval."""
        low, high = (min(max(end, node.low), node.high) for end in (self.low, self.high))
        margin = _NEARER * max(abs(node.low), abs(node.high))
        is_nearer = (low > node.low + margin, high < node.high - margin)
        if not any(is_nearer):
            return _interval_of(node)
        is_outside = self.low < node.low or self.high > node.high
        return _DerivedEnds(low, high, self.base | {node} if is_outside else self.base)


def _interval_of(node: Node) -> _DerivedEnds:
    return _DerivedEnds(node.low, node.high, frozenset({node}))


def _derived_ends(node: Node, sides: Sides, steps: int = _BACK) -> _DerivedEnds:
    """Ends of a node on the given sides, narrower than a claim where its argument's are narrower.

    A constant where x is negative, else x, is not below both 0 and the constant.
    """
    if steps == 0 or not node.args:
        return _interval_of(node)
    return _ends_on(node, tuple((n, sides[n]) for n in _conditions_of(node) if n in sides), steps)


@lru_cache(maxsize=2**17)
def _ends_on(node: Node, side_pairs: tuple[tuple[int, int], ...], steps: int) -> _DerivedEnds:
    """Derived ends of a node with arguments, on these sides of conditions."""
    sides = dict(side_pairs)
    if node.kind in ("bounded", "saturated"):
        return _derived_ends(node.args[0], sides, steps).within(node)
    if node.kind == "select" and (side := side_of(node.args[0], sides)):
        return _derived_ends(node.args[side], sides, steps - 1)
    if node.kind == "select" and node.args[0] is node.args[2] and node.args[1].kind == "const":
        interval = _interval_of(node)
        return replace(interval, low=max(interval.low, min(0.0, node.args[1].value)))
    if node.kind not in ("mul", "sum"):
        return _interval_of(node)
    arg_ends = [_derived_ends(arg, sides, steps - 1) for arg in node.args]
    base = frozenset[Node]().union(*(arg.base for arg in arg_ends))
    if node.kind == "mul":
        x, y = ((arg.low, arg.high) for arg in arg_ends)
        low, high = ends_of_product(x, y)
        return _DerivedEnds(low, high, base).within(node)
    low = high = 0.0
    for arg, sign in zip(arg_ends, node.signs, strict=True):
        start, end = (arg.low, arg.high)[::sign]
        low, high = low + sign * start, high + sign * end
    return _DerivedEnds(low, high, base).within(node)


def sources_of(node: Node, sides: Sides | None = None) -> Iterator[Node]:
    """Nodes from whose intervals the derived ends of a node follow.

    ``sides``: the given sides of conditions; None: any sides.
    """
    if sides is not None:
        yield from sorted(_derived_ends(node, sides).base, key=lambda n: n.number)
        return
    conditions = sorted({*conditions_in(node)})
    if len(conditions) > _SIDES:
        yield from _made_of(node)
        return
    base = set[Node]()
    for choice in product((0, 1, 2), repeat=len(conditions)):
        fixed = {n: s for n, s in zip(conditions, choice, strict=True) if s}
        base |= _derived_ends(node, fixed).base
    yield from sorted(base, key=lambda n: n.number)


def conditions_in(node: Node) -> Iterator[int]:
    """Conditions, by number, on whose sides the ends of a node may depend."""
    return (n.args[0].number for n in _made_of(node) if n.kind == "select")


@lru_cache(maxsize=2**14)
def _conditions_of(node: Node) -> tuple[int, ...]:
    """The same in order, each once, with the conditions that they combine."""
    stack = [n.args[0] for n in _made_of(node) if n.kind == "select"]
    visited = set[int]()
    while stack:
        condition = stack.pop()
        if condition.number not in visited:
            visited.add(condition.number)
            stack += condition.args if condition.kind == "select" else ()
    return tuple(sorted(visited))


def _made_of(node: Node) -> Iterator[Node]:
    """A node and those from which its derived ends are computed."""
    steps_left = {node.number: _BACK}
    stack = [node]
    while stack:
        node = stack.pop()
        yield node
        steps = steps_left[node.number] - (node.kind not in ("bounded", "saturated"))
        if steps >= 0 and node.kind in ("bounded", "saturated", "mul", "select", "sum"):
            for arg in node.args[1:] if node.kind == "select" else node.args:
                if steps_left.get(arg.number, -1) < steps:
                    steps_left[arg.number] = steps
                    stack.append(arg)
