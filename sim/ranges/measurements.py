"""What measurements take of vectors: their parts along unit vectors.

h P h + v is |m|^2, m = sum_k h_k p_k + sqrt(v) e, and what a measurement takes of each vector is
its part along the unit vector u = m / |m|: a gain L_i = P_i: h / |m| is p_i . u, and P - L L^T is
that of p_i - (p_i . u) u, shorter than p_i.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.claims import Premises
from boresight.sim.ranges.coefficients import ONE, Coefficient
from boresight.sim.ranges.inner_products import Vector, is_scaled, of_unit
from boresight.sim.ranges.noise import least_of
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.terms import Term, Terms

__all__ = ["Measurements"]


class Measurements:
    """The unit vectors of a step, and gains.

    Parameters
    ----------
    pairs, terms
        What the nodes are.
    premises : Premises
        Gets what shares are not negative by.

    Attributes
    ----------
    weights : dict of int to (list of Vector, Vector)
        Of an inverse root 1 / |m|, by its node: m, with and without noise, and the unit vector.
    """

    def __init__(self, pairs: Pairs, terms: Terms, premises: Premises) -> None:
        self.pairs, self.terms, self.space = pairs, terms, pairs.space
        self.points, self.premises = pairs.points, premises
        self.weights: dict[int, tuple[list[Vector], Vector]] = {}

    def weigh(self, node: Node) -> None:
        """Find the unit vector along m, of the inverse root of |m|^2."""
        total = next(iter(self.pairs.roots_of(node.args[0])), None)
        if total is None:
            return
        at = total.at / np.where(total.length > 0.0, total.length, 1.0)[:, None]
        unit = self.space.add(at, measured=total)
        alike = [total, self.space.without_noise(total)]
        self.weights[node.number] = alike, unit
        while total is not alike[1]:
            total.of_measurement = True
            if total.noise:
                break
            total = total.parts[0][1]

    def weigh_column(self, node: Node) -> bool:
        """Find whose inner product a gain is: P_i: h times an inverse root; False: it is none."""
        at = next((k for k, a in enumerate(node.args) if a.number in self.weights), None)
        if at is not None:
            self.gain(node, node.args[1 - at], *self.weights[node.args[at].number])
        return at is not None

    def gain(self, node: Node, column: Node, alike: Sequence[Vector], unit: Vector) -> None:
        """The inner product with a unit vector, of that with what it is along."""
        for x, y in self.pairs.of(column):
            for one, other in ((x, y), (y, x)):
                along = None
                if other in alike:
                    along = unit
                elif is_scaled(other):
                    (chosen, whole), *_ = other.parts
                    if whole in alike and chosen.is_choice:
                        along = self.pairs.sum_of(((chosen, unit),))
                if along is not None and self.pairs.is_product(node, (one, along)):
                    self.pairs.found.setdefault(node.number, []).append((one, along))
                    return

    def taken(self, products: Sequence[Term]) -> list[tuple[Coefficient, Vector]] | None:
        """The unit vectors along which products are taken, in order, and when each is.

        None: a product is of another form.
        """
        out: dict[int, tuple[Coefficient, Vector]] = {}
        for term in products:
            a, b = (
                [v for pair in self.pairs.of(f) for v in pair if of_unit(v)] for f in term.factors
            )
            unit = next((v for v in a if v in b), None) or self._share_of(term)
            if unit is None:
                return None
            out[unit.number] = Coefficient(sides=term.coefficient.sides), unit
        return [out[n] for n in sorted(out)]

    def _share_of(self, term: Term) -> Vector | None:
        """The root of k, times m, of a product k (x . m)(m . y); None: of another form."""
        first, second = ([v for p in self.pairs.of(f) for v in p] for f in term.factors)
        own = Coefficient(nodes=term.coefficient.nodes)
        ways = [(own, m) for m in first if m in second and own.nodes]
        for some, others in ((first, second), (second, first)):
            ways += [v.parts[0] for v in some if is_scaled(v) and v.parts[0][1] in others]
        for c, m in ways:
            if self._is_share(c, m):
                root = np.sqrt(np.maximum(self.points.at(c), 0.0))
                return self.space.add(root[:, None] * m.at, measured=m, share=True)
        return None

    def _is_share(self, c: Coefficient, m: Vector) -> bool:
        """Whether a coefficient is w / (w |m|^2 + v), neither w nor v negative."""
        if c.number != 1.0 or c.sides or len(c.nodes) != 1:
            return False
        *limits, node = _claims_of(c.nodes[0])
        factors = node.args if node.kind == "mul" else (node,)
        inverse = [f for f in factors if f.kind == "reciprocal"]
        weights = tuple(f for f in factors if f.kind != "reciprocal")
        if len(inverse) != 1 or any(w.low < 0.0 for w in weights):
            return False
        *more, total = _claims_of(inverse[0].args[0])
        terms = self.terms.of_arguments(total) or []
        squares = [t for t in terms if t.factors]
        rest = [t.coefficient for t in terms if not t.factors]
        if len(squares) != 1 or least_of(rest) < 0.0:
            return False
        (square,), by = squares, Coefficient(nodes=weights)
        scaled = next((v for v in self.space.vectors if v.parts == ((by, m),)), None)
        if square.coefficient == by:
            pair = m, m
        elif square.coefficient == ONE and scaled is not None:
            pair = scaled, m
        else:
            return False
        if len(square.factors) != 1 or not self.pairs.is_product(square.factors[0], pair):
            return False
        self.points.passed |= {n.number for n in (*limits, *more)}
        self.premises.base |= {n for k in (*rest, by) for n in k.nodes}
        return True


def _claims_of(node: Node) -> Iterator[Node]:
    """The claims of a node, one after the other, and what they are of."""
    yield node
    while node.kind == "bounded":
        node = node.args[0]
        yield node
