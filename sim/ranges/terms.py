"""Nodes as sums of coefficients times inner products, and the limits that conditions set them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient, Sides, sources_of
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.steps import implied

__all__ = ["Term", "Terms"]

#: Most terms of a sum, and of one without inner products, which else stays one node.
_TERMS, _LOOSE = 400, 8


@dataclass(frozen=True)
class Term:
    """A coefficient times inner products: none, one or two."""

    coefficient: Coefficient
    factors: tuple[Node, ...] = ()


class Terms:
    """The terms, by node.

    Parameters
    ----------
    pairs : Pairs
        Which nodes are inner products.
    """

    def __init__(self, pairs: Pairs) -> None:
        self.pairs, self.points = pairs, pairs.points
        self._terms_by_node: dict[int, list[Term] | None] = {}
        self._limits: dict[tuple[int, int], tuple[dict[int, float], float]] = {}

    def of(self, node: Node) -> list[Term] | None:
        """A node as a sum of terms; None: too many."""
        if not self.points.values[node.number].any():
            return []
        if node.number not in self.points.cone:
            c = Coefficient(node.value) if node.kind == "const" else Coefficient(nodes=(node,))
            return [Term(c)]
        if self.pairs.of(node):
            return [Term(ONE, (node,))]
        if node.number not in self._terms_by_node:
            self._terms_by_node[node.number] = self.of_arguments(node)
        return self._terms_by_node[node.number]

    def of_arguments(self, node: Node) -> list[Term] | None:
        """The terms of a node's arguments, whether it is an inner product or not."""
        parts: list[list[Term] | None]
        if node.kind == "sum":
            signed_args = zip(node.args, node.signs, strict=True)
            parts = [_multiplied(self.of(a), Coefficient(s)) for a, s in signed_args]
        elif node.kind == "bounded":
            parts = [self.of(node.args[0])]
        elif node.kind in ("select", "flip"):
            c, sign = node.args[0].number, -1.0 if node.kind == "flip" else 1.0
            yes, no = (Coefficient(s, (), frozenset({(c, k)})) for s, k in ((sign, 1), (1.0, 2)))
            parts = [
                _multiplied(self.of(node.args[1]), yes),
                _multiplied(self.of(node.args[-1]), no),
            ]
        elif node.kind == "mul":
            parts = [self._product(*node.args)]
        else:
            parts = [[]]
        if any(part is None for part in parts):
            return None
        out = [term for part in parts for term in part or ()]
        is_atomic = node.kind == "mul" or len(out) > _LOOSE or not out
        if is_atomic and not any(t.factors for t in out):
            return [Term(Coefficient(nodes=(node,)))]
        return out if len(out) <= _TERMS else None

    def _product(self, a: Node, b: Node) -> list[Term] | None:
        """Terms of a product with a factor made of inner products; else none."""
        cone = self.points.cone
        are_products = [n.number in cone and bool(self.pairs.of(n)) for n in (a, b)]
        if all(are_products):
            return [Term(ONE, (a, b))]
        if a is b:
            return [Term(Coefficient(nodes=(a, b)))]
        for node, other, is_product in ((a, b, are_products[0]), (b, a, are_products[1])):
            if is_product and other.number in cone:
                terms = self.of(other) or []
                if [len(t.factors) for t in terms] == [1]:
                    return [Term(terms[0].coefficient, (terms[0].factors[0], node))]
            if is_product or other.number not in cone:
                return self._scaled(node, other)
        for node, other in ((a, b), (b, a)):
            parts = self.of(node)
            if parts is None or any(t.factors for t in parts):
                return self._scaled(node, other)
        return []

    def _scaled(self, node: Node, factor: Node) -> list[Term] | None:
        """A node times a factor; both sides of the factor if it is a selection that P decides."""
        if factor.kind == "const":
            return _multiplied(self.of(node), Coefficient(factor.value))
        if factor.kind != "select" or factor.number not in self.points.cone:
            return _multiplied(self.of(node), Coefficient(nodes=(factor,)))
        out: list[Term] = []
        for side in (1, 2):
            part = self._scaled(node, factor.args[side])
            choice = frozenset({(factor.args[0].number, side)})
            part = _multiplied(part, Coefficient(sides=choice))
            if part is None:
                return None
            out += part
        return out

    # -- limits by conditions ---------------------------------------------------------------------

    def limits_on(self, sides: Sides) -> Iterator[tuple[dict[int, float], float]]:
        """Factors of squared lengths, by vector, and the upper bound of the sum on these sides."""
        for condition_side in implied(self.points.nodes, sides):
            if condition_side not in self._limits:
                self._limits[condition_side] = self._limit_of(*condition_side)
            if self._limits[condition_side][0]:
                yield self._limits[condition_side]

    def _limit_of(self, condition: int, side: int) -> tuple[dict[int, float], float]:
        """The factors and the bound of one condition; no factors if it is of another form."""
        sign = 1.0 if side == 1 else -1.0
        rest, squares, base = 0.0, dict[int, float](), set[Node]()
        for t in self.of(self.points.nodes[condition]) or ():
            c = t.coefficient
            if not t.factors:
                low, high = c.ends({})
                rest += low if sign > 0.0 else -high
                base |= {n for m in c.nodes for n in sources_of(m, {})}
                continue
            vectors = self.pairs.roots_of(t.factors[0])
            if len(t.factors) > 1 or c.nodes or c.sides or not vectors or sign * c.number <= 0.0:
                return {}, 0.0
            squares |= {x.number: sign * c.number for x in vectors}
        self.points.premises.base |= base if squares else set()
        return squares, -rest


def _multiplied(terms: Sequence[Term] | None, factor: Coefficient) -> list[Term] | None:
    """A sum times a coefficient."""
    if terms is None:
        return None
    products = (Term(factor.times(t.coefficient), t.factors) for t in terms)
    return [t for t in products if t.coefficient.number]
