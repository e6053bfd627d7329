"""Vectors of a step that are at most of length one, by the divisor of their components.

c_i / sqrt(S) with S >= sum of c_i^2, also where the inverse root is one factor of several, and
where a selection leaves it out. A limit of a term of S is not reached where a condition of that
selection excludes it.

A c may be a root itself, c = x / sqrt(x) with c^2 = x, as in the sine and cosine of an elevation,
u / sqrt(S) and sqrt(e^2 + n^2) / sqrt(S) with S = e^2 + n^2 + u^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import (
    Polynomial,
    is_sum_of_squares,
    plus,
    polynomial_of,
    scaled,
    times,
)
from boresight.sim.ranges.steps import implied

__all__ = ["Ball", "UnitVectors", "bare", "under_root"]

#: Terms of a polynomial; steps back to its variables; sides of conditions.
_TERMS, _DEPTH, _SIDES = 100, 24, 6


@dataclass(frozen=True)
class Ball:
    """A vector of limited length, with the premises of the limit.

    Attributes
    ----------
    numbers : frozenset of int
        Of its components.
    used, aliases : frozenset of int
        Nodes whose intervals it follows from, and "bounded" ones that count as their arguments.
    square : float
        Largest squared length.
    """

    numbers: frozenset[int]
    used: frozenset[int] = frozenset()
    aliases: frozenset[int] = frozenset()
    square: float = 1.0


class UnitVectors:
    """The vectors, as ``balls``."""

    def __init__(self, nodes: Mapping[int, Node]) -> None:
        self.nodes = nodes
        self.bounded = {n.number for n in nodes.values() if n.kind == "bounded"}
        self.balls: list[Ball] = [*self._divided(), *self._scaled()]

    def _divided(self) -> Iterator[Ball]:
        """Components that one inverse root divides."""
        for divisor, products in self._with_factor(lambda node: node.kind == "rsqrt"):
            groups = _by_multiplicand(products)
            radicand = divisor.args[0].number  # x / sqrt(x) uses all of it
            others = {number: parts for number, parts in groups.items() if number != radicand}
            for selection in (groups, others) if len(others) < len(groups) else (groups,):
                for ends in (selection.keys(), ()):
                    aliases = set[int]()
                    members = self._squares_below(divisor, selection, ends, aliases)
                    if len(members) > 1:
                        yield from _balls(members, set(), aliases)
                        break

    def _scaled(self) -> Iterator[Ball]:
        """Components with a factor that contains an inverse root."""
        for factor, products in self._with_factor(_has_root):
            groups = _by_multiplicand(products)
            used, aliases = set[int](), set[int]()
            if len(groups) > 1 and self._largest([*groups], [factor], {}, used, aliases) <= 1.0:
                yield from _balls([*groups.values()], used, aliases)

    def _with_factor(
        self, is_factor: Callable[[Node], bool]
    ) -> Iterator[tuple[Node, dict[int, Node]]]:
        """Factors of a kind, each with its multiplicands, by the number of the product."""
        products: dict[int, dict[int, Node]] = {}
        for node in self.nodes.values():
            inner = bare(node)
            if inner.kind == "mul":
                for c, factor in (inner.args, inner.args[::-1]):
                    if is_factor(factor):
                        products.setdefault(factor.number, {})[node.number] = c
                        break
        for number, parts in products.items():
            yield self.nodes[number], parts

    def _squares_below(
        self,
        divisor: Node,
        groups: Mapping[int, list[int]],
        ends: Container[int],
        aliases: set[int],
    ) -> list[list[int]]:
        """Components whose squares together are at most the radicand."""
        rest = polynomial_of(divisor.args[0], _TERMS, _DEPTH, ends, aliases)
        members = list[list[int]]()
        for multiplicand, numbers in groups.items():
            square = self._square(multiplicand, ends, aliases)
            if rest is None or square is None:
                continue
            difference = plus(rest, scaled(square, -1.0))
            if is_sum_of_squares(difference):
                rest, members = difference, [*members, numbers]
        return members

    def _square(self, number: int, ends: Container[int], aliases: set[int]) -> Polynomial | None:
        """The square of a node or an upper bound: x for x / sqrt(x), limited or not."""
        node = self.nodes[number]
        x = None if number in ends else under_root(node)
        if x is not None:
            form = polynomial_of(x, _TERMS, _DEPTH, ends, aliases)
            return form if form is not None and is_sum_of_squares(form) else None
        part = polynomial_of(node, _TERMS, _DEPTH, ends, aliases)
        return None if part is None else times(part, part, _TERMS)

    def _largest(
        self,
        parts: Sequence[int],
        factors: Sequence[Node],
        sides: Mapping[int, int],
        used: set[int],
        aliases: set[int],
    ) -> float:
        """Upper bound of the sum of the squares of some nodes, each times the factors."""
        atoms: list[Node] = []
        for k, factor in enumerate(factors):
            others = [*atoms, *factors[k + 1 :]]
            node = factor
            while node.kind == "bounded" and bare(node).kind in ("mul", "select", "rsqrt"):
                aliases.add(node.number)
                node = node.args[0]
            if node.kind == "mul":
                return self._largest(parts, [*others, *node.args], sides, used, aliases)
            if node.kind == "select":
                number = node.args[0].number
                if number not in sides and len(sides) >= _SIDES:
                    return math.inf
                return max(
                    self._largest(
                        parts, [*others, node.args[s]], {**sides, number: s}, used, aliases
                    )
                    for s in ((sides[number],) if number in sides else (1, 2))
                )
            if node.kind == "const" and node.value == 0.0:
                return 0.0
            atoms.append(node)
        for k, root in enumerate(atoms):
            if root.kind == "rsqrt" and self._is_below(root.args[0], parts, sides, used, aliases):
                bound = 1.0
                for node in (*atoms[:k], *atoms[k + 1 :]):
                    used.add(node.number)
                    bound *= max(node.low * node.low, node.high * node.high)
                return bound
        return math.inf

    def _is_below(
        self,
        total: Node,
        parts: Sequence[int],
        sides: Mapping[int, int],
        used: set[int],
        aliases: set[int],
    ) -> bool:
        """Whether the squares of some nodes together are at most a node, on these sides."""
        while total.kind == "bounded":
            aliases.add(total.number)
            total = total.args[0]
        ends = self.bounded.union(parts)
        form = polynomial_of(total, _TERMS, _DEPTH, ends)
        for (number,) in [m for m in form or {} if len(m) == 1]:
            node = self.nodes[number]
            if form is not None and node.kind == "saturated" and self._is_within_limit(node, sides):
                used.add(node.args[0].number)
                argument = polynomial_of(node.args[0], _TERMS, _DEPTH, ends)
                factor = form.pop((number,))
                form = None if argument is None else plus(form, scaled(argument, factor))
        for number in parts:
            square = self._square(number, ends, aliases)
            if form is None or square is None:
                return False
            form = plus(form, scaled(square, -1.0))
        return form is not None and is_sum_of_squares(form)

    def _is_within_limit(self, limited: Node, sides: Mapping[int, int]) -> bool:
        """Whether sides of conditions keep a value below its upper limit, and it has no other."""
        if limited.args[0].low < -limited.value:
            return False
        for number, side in implied(self.nodes, sides):
            form = polynomial_of(
                self.nodes[number], _TERMS, _DEPTH, self.bounded | {limited.number}
            )
            if form is None or not set(form) <= {(), (limited.number,)}:
                continue
            slope = form.get((limited.number,), 0.0)
            is_upper = (slope > 0.0 and side == 1) or (slope < 0.0 and side == 2)
            if is_upper and -form.get((), 0.0) / slope < limited.value:
                return True
        return False


def bare(node: Node, aliases: set[int] | None = None) -> Node:
    """A node without its limits; ``aliases`` gets the "bounded" ones among them."""
    while node.kind in ("bounded", "saturated"):
        if aliases is not None and node.kind == "bounded":
            aliases.add(node.number)
        node = node.args[0]
    return node


def under_root(node: Node) -> Node | None:
    """x of x / sqrt(x), limited or not."""
    inner = bare(node)
    for x, root in (inner.args, inner.args[::-1]) if inner.kind == "mul" else ():
        if root.kind == "rsqrt" and root.args[0] is x:
            return x
    return None


def _has_root(node: Node) -> bool:
    """Whether a factor is a product or a selection that contains an inverse root."""
    inner = bare(node)
    if inner.kind == "rsqrt":
        return inner is not node
    if inner.kind in ("mul", "select"):
        return any(bare(a).kind == "rsqrt" or _has_root(a) for a in inner.args[-2:])
    return False


def _by_multiplicand(products: Mapping[int, Node]) -> dict[int, list[int]]:
    """Products by their multiplicands: one product may also occur with a limit."""
    groups: dict[int, list[int]] = {}
    for number, multiplicand in products.items():
        groups.setdefault(multiplicand.number, []).append(number)
    return groups


def _balls(members: Sequence[Sequence[int]], used: set[int], aliases: set[int]) -> Iterator[Ball]:
    for k in range(max(map(len, members))):
        numbers = frozenset(m[min(k, len(m) - 1)] for m in members)
        yield Ball(numbers, frozenset(used), frozenset(aliases))
