"""Nodes as sums of coefficients times inner products, and what conditions on such sums say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient, Sides, known_from
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.steps import implied

__all__ = ["Term", "Terms"]

#: Terms of a sum, and of one without inner products, which then stays whole.
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
        self._known: dict[int, list[Term] | None] = {}
        self._limits: dict[tuple[int, int], tuple[dict[int, float], float]] = {}

    def of(self, node: Node) -> list[Term] | None:
        """A node as a sum of terms; None: too many."""
        if not self.points.values[node.number].any():
            return []
        if node.number not in self.points.cone:
            by = Coefficient(node.value) if node.kind == "const" else Coefficient(nodes=(node,))
            return [Term(by)]
        if self.pairs.of(node):
            return [Term(ONE, (node,))]
        if node.number not in self._known:
            self._known[node.number] = self.of_arguments(node)
        return self._known[node.number]

    def of_arguments(self, node: Node) -> list[Term] | None:
        """The same of a node's arguments, whether it is an inner product or not."""
        parts: list[list[Term] | None]
        if node.kind == "sum":
            each = zip(node.args, node.signs, strict=True)
            parts = [_multiplied(self.of(a), Coefficient(s)) for a, s in each]
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
        whole = node.kind == "mul" or len(out) > _LOOSE or not out
        if whole and not any(t.factors for t in out):
            return [Term(Coefficient(nodes=(node,)))]
        return out if len(out) <= _TERMS else None

    def _product(self, a: Node, b: Node) -> list[Term] | None:
        """A product of which one factor, at least, is made of inner products; else none."""
        cone = self.points.cone
        known = [n.number in cone and bool(self.pairs.of(n)) for n in (a, b)]
        if all(known):
            return [Term(ONE, (a, b))]
        if a is b:
            return [Term(Coefficient(nodes=(a, b)))]
        for one, other, is_known in ((a, b, known[0]), (b, a, known[1])):
            if is_known and other.number in cone:
                terms = self.of(other) or []
                if [len(t.factors) for t in terms] == [1]:
                    return [Term(terms[0].coefficient, (terms[0].factors[0], one))]
            if is_known or other.number not in cone:
                return self._scaled(one, other)
        for one, other in ((a, b), (b, a)):
            parts = self.of(one)
            if parts is None or any(t.factors for t in parts):
                return self._scaled(one, other)
        return []

    def _scaled(self, node: Node, factor: Node) -> list[Term] | None:
        """A node times a factor, each side of it where it is a selection that P decides."""
        if factor.kind == "const":
            return _multiplied(self.of(node), Coefficient(factor.value))
        if factor.kind != "select" or factor.number not in self.points.cone:
            return _multiplied(self.of(node), Coefficient(nodes=(factor,)))
        out: list[Term] = []
        for side in (1, 2):
            part = self._scaled(node, factor.args[side])
            chosen = frozenset({(factor.args[0].number, side)})
            part = _multiplied(part, Coefficient(sides=chosen))
            if part is None:
                return None
            out += part
        return out

    # -- what conditions compare ------------------------------------------------------------------

    def limits_on(self, sides: Sides) -> Iterator[tuple[dict[int, float], float]]:
        """Factors of squared lengths, by vector, and what their sum is at most on these sides."""
        for said in implied(self.points.nodes, sides):
            if said not in self._limits:
                self._limits[said] = self._compared(*said)
            if self._limits[said][0]:
                yield self._limits[said]

    def _compared(self, condition: int, side: int) -> tuple[dict[int, float], float]:
        """The factors and the sum of one condition; no factors where it compares something else."""
        sign = 1.0 if side == 1 else -1.0
        rest, squares, base = 0.0, dict[int, float](), set[Node]()
        for t in self.of(self.points.nodes[condition]) or ():
            c = t.coefficient
            if not t.factors:
                low, high = c.ends({})
                rest += low if sign > 0.0 else -high
                base |= {n for m in c.nodes for n in known_from(m, {})}
                continue
            own = self.pairs.roots_of(t.factors[0])
            if len(t.factors) > 1 or c.nodes or c.sides or not own or sign * c.number <= 0.0:
                return {}, 0.0
            squares |= {x.number: sign * c.number for x in own}
        self.points.premises.base |= base if squares else set()
        return squares, -rest


def _multiplied(terms: Sequence[Term] | None, by: Coefficient) -> list[Term] | None:
    """A sum times a coefficient."""
    if terms is None:
        return None
    products = (Term(by.times(t.coefficient), t.factors) for t in terms)
    return [t for t in products if t.coefficient.number]
