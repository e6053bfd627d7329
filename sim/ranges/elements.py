"""Nodes as polynomials of the elements of a covariance, on each side of their selections."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import Polynomial, cleared, combined, polynomial_of

__all__ = ["TERMS", "Family", "Forms", "Linear", "Sides"]

#: Terms of a polynomial; conditions of which both sides are tried.
TERMS, _CONDITIONS = 1000, 6
#: Which side of each condition holds, by the condition's number: 1 negative, 2 not.
Sides = dict[int, int]
#: Of a linear form of the elements (k, l), k <= l: the coefficients.
Linear = dict[tuple[int, int], Polynomial]


@dataclass(eq=False)
class Family:
    """A symmetric matrix of nodes that is a covariance."""

    numbers: list[list[int]]
    at: dict[int, tuple[int, int]] = field(init=False)
    cone: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        size = range(len(self.numbers))
        self.at = {self.numbers[k][j]: (j, k) for k in size for j in range(k + 1)}


class Forms:
    """The polynomials of a step; ``passed`` has the "bounded" nodes that count as arguments."""

    def __init__(self, nodes: Mapping[int, Node]) -> None:
        self.nodes = nodes
        self.passed: set[int] = set()
        self.limited: dict[Any, Polynomial | None] = {}

    def parts_of(
        self, monomial: tuple[int, ...], family: Family
    ) -> tuple[list[int], list[int], tuple[int, ...]]:
        """Elements, inverses of what depends on them, and all else of a term."""
        elements = [n for n in monomial if n in family.at]
        weights = [
            n
            for n in monomial
            if n in family.cone
            and n not in family.at
            and self.nodes[n].kind in ("rsqrt", "reciprocal")
        ]
        return elements, weights, tuple(n for n in monomial if n not in elements + weights)

    def sorted_terms(
        self, form: Polynomial, family: Family
    ) -> tuple[Linear, dict[int, Polynomial], Polynomial] | None:
        """Terms of one element, those of two by the inverse that they have, and those of none.

        None: there are others.
        """
        linear: Linear = {}
        taken: dict[int, Polynomial] = {}
        rest: Polynomial = {}
        for m, c in form.items():
            elements, weights, others = self.parts_of(m, family)
            if not elements and not weights:
                part, key = rest, m
            elif len(elements) == 1 and not weights:
                part, key = linear.setdefault(family.at[elements[0]], {}), others
            elif len(elements) == 2 and (weight := self._weight(weights)) is not None:
                part, key = taken.setdefault(weight, {}), tuple(sorted((*elements, *others)))
            else:
                return None
            part[key] = part.get(key, 0.0) + c
        return linear, taken, rest

    def _weight(self, weights: Sequence[int]) -> int | None:
        """The node whose inverse the weights are."""
        kinds = [self.nodes[n].kind for n in weights]
        if kinds == ["reciprocal"] or (kinds == ["rsqrt"] * 2 and weights[0] == weights[1]):
            return weights[0]
        return None

    def cases(
        self,
        nodes: Sequence[Node],
        family: Family,
        sides: Sides | None = None,
        *,
        split: bool = False,
    ) -> Iterator[tuple[list[Polynomial | None], Sides]]:
        """Forms of some nodes for each side of the conditions that they depend on."""
        sides = sides or {}
        forms: list[Polynomial | None] = []
        for node in nodes:
            form, condition = self.of(node, family, sides, split=split)
            if condition is not None:
                if len(sides) >= _CONDITIONS:
                    yield [None] * len(nodes), sides
                    return
                for side in (1, 2):
                    more = {**sides, condition: side}
                    if self._possible(more):
                        yield from self.cases(nodes, family, more, split=split)
                return
            forms.append(form)
        yield forms, sides

    def _possible(self, sides: Sides) -> bool:
        """Whether conditions about one value can hold together, as x < 1 and not x < 2 cannot."""
        ends: dict[tuple[tuple[tuple[int, ...], float], ...], tuple[float, float]] = {}
        for number, side in sides.items():
            form = polynomial_of(self.nodes[number], TERMS, 3)
            if form is None:
                continue
            alone, first = form.pop((), 0.0), next(iter(form.values()), 0.0)
            if first == 0.0:
                continue
            key = tuple(sorted((m, c / first) for m, c in form.items()))
            low, high = ends.get(key, (-math.inf, math.inf))
            if (side == 1) == (first > 0.0):
                high = min(high, -alone / first)
            else:
                low = max(low, -alone / first)
            ends[key] = low, high
        return all(low <= high for low, high in ends.values())

    def of(
        self, node: Node, family: Family, sides: Sides, *, whole: bool = False, split: bool = False
    ) -> tuple[Polynomial | None, int | None]:
        """A node as a polynomial of a family's elements and of what does not depend on them.

        With the first condition, if any, of which a side has to be chosen before, ``split``: also
        of those that choose from constants; ``whole``: selections stay as they are.
        """
        known: dict[int, Polynomial | None] = {}
        open_at: list[int] = []

        def form_of(at: Node) -> Polynomial | None:
            if at.number not in known:
                form = made(at)
                if form is not None and at.kind in ("sum", "bounded"):
                    elements, weights, rest = self.parts_of(tuple(set[int]().union(*form)), family)
                    if not elements and not weights and not family.cone.isdisjoint(rest):
                        form = _alone(at)  # of what a limit or a selection hides
                known[at.number] = form
            return known[at.number]

        def made(at: Node) -> Polynomial | None:
            if at.number in family.at:
                return _alone(at)
            if at.kind == "const":
                return {(): at.value} if at.value else {}
            inside = at.number in family.cone
            chooses = (
                split and at.kind == "select" and at.args[1].kind == at.args[2].kind == "const"
            )
            if at.kind == "select" and (inside or chooses or at.args[0].number in sides):
                if at.args[0].number not in sides and whole:
                    return _alone(at)
                if at.args[0].number not in sides:
                    open_at.append(at.args[0].number)
                    return None
                return form_of(at.args[sides[at.args[0].number]])
            if at.kind == "saturated" and inside:
                key = at.number, family.numbers[0][0], tuple(sorted(sides.items()))
                if key not in self.limited:
                    self.limited[key] = self.of(at.args[0], family, sides, whole=True)[0]
                form = self.limited[key]
                if form is not None and set(form) <= {()}:
                    return {(): min(max(form.get((), 0.0), -at.value), at.value)}
            if at.kind == "bounded" and (inside or split):
                self.passed.add(at.number)
                form = form_of(at.args[0])
                return form if inside or form is None or set(form) <= {()} else _alone(at)
            if at.kind == "mul" or (at.kind == "sum" and (inside or split)):
                parts = [form_of(arg) for arg in at.args]
                if open_at or any(part is None for part in parts):
                    return None
                some = [part for part in parts if part is not None]
                return cleared(combined(at, some, TERMS))
            return _alone(at)

        form = form_of(node)
        return form, open_at[0] if open_at else None


def _alone(node: Node) -> Polynomial:
    return {(node.number,): 1.0}
