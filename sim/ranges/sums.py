"""Sums of vectors: whose inner products the nodes of a step are.

Of F P F^T the vectors are sums, sum_k F_ik p_k; a selection chooses between vectors: its condition
may have either side. `noise` and `measurements` have the other ways to make vectors of vectors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient
from boresight.sim.ranges.inner_products import Pair, Vector, is_scaled, made_from
from boresight.sim.ranges.measurements import Measurements
from boresight.sim.ranges.noise import Noise
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.terms import Term, Terms

__all__ = ["Sums"]

#: Vectors that are tried, of those that all terms may be inner products with.
_TRIED = 4


class Sums:
    """The vectors of nodes, of each after its arguments.

    Parameters
    ----------
    terms : Terms
        Of the nodes.
    measurements, noise
        Which make vectors of others.
    """

    def __init__(self, terms: Terms, measurements: Measurements, noise: Noise) -> None:
        self.terms, self.measurements, self.noise = terms, measurements, noise
        self.pairs: Pairs = terms.pairs
        self.space, self.points = self.pairs.space, self.pairs.points

    def find(self, node: Node, wanted: Set[int]) -> None:
        """Find the vectors of a node; of a product or a selection, if it is ``wanted``."""
        if node.kind == "rsqrt":
            self.measurements.weigh(node)
        elif node.kind == "mul" and self.measurements.weigh_column(node):
            pass
        elif node.kind in ("bounded", "saturated"):
            self.pairs.of(node)
            if node.kind == "bounded" and node.args[0].number in self.pairs.sums:
                self.pairs.sums[node.number] = self.pairs.sums[node.args[0].number]
        elif node.kind == "sum" or (
            node.kind in ("mul", "select", "flip") and node.number in wanted
        ):
            self._take_apart(node)

    def _take_apart(self, node: Node) -> None:
        """Find the vectors of a sum of terms."""
        terms = self.terms.of(node)
        if terms is None:
            return
        rest = tuple(t.coefficient for t in terms if not t.factors)
        linear = [t for t in terms if len(t.factors) == 1]
        products = [t for t in terms if len(t.factors) == 2]
        value = self.points.values[node.number] - self.points.total(rest)
        size = self.points.sizes[node.number]
        pairs = self.pairs.latest(value, size)
        if [t.coefficient.number < 0.0 for t in linear] == [True]:
            return  # of a vector and its negative there is one
        if not pairs and linear:
            candidates = self._candidates(linear, products)
            pairs = [pair for pair in candidates if self.space.is_pair(pair, value, size)]
        if not pairs:
            return
        self.pairs.sums[node.number] = pairs, rest
        found = self.pairs.found.setdefault(node.number, [])
        if not rest:
            found += pairs
            return
        alike = (v for pair in pairs for v in self._alike(pair))
        v = next((v for v in alike if self.space.is_pair((v, v), value, size)), None)
        noisy = None if v is None else self.noise.added(v, rest)
        found += [(noisy, noisy)] if noisy else []

    def _alike(self, pair: Pair) -> Iterator[Vector]:
        """Vectors whose square an inner product may be: one of two, or less of it.

        The other may have no part along some unit vectors: what the first one has does not count.
        """
        units = {v.unit.number: v.unit for v in made_from(pair) if v.unit is not None}
        yield from dict.fromkeys(pair)
        for v in dict.fromkeys(pair):
            chosen = [c for c, _ in v.parts if is_scaled(v) and c.is_choice]
            inner = v.parts[0][1] if chosen else v
            for number in sorted(units):
                inner = self.space.less(inner, units[number])
                yield self.pairs.sum_of(((chosen[0], inner),)) if chosen else inner

    def _candidates(self, linear: Sequence[Term], products: Sequence[Term]) -> Iterator[Pair]:
        """Pairs that a sum may be the inner product of."""
        taken = self.measurements.taken(products)
        if taken is None:
            return
        for x, y in self._common(linear):
            for chosen, unit in taken:
                unit = self.pairs.sum_of(((chosen, unit),)) if chosen.sides else unit
                x, y = self.space.less(x, unit), self.space.less(y, unit)
            yield x, y

    def _common(self, linear: Sequence[Term]) -> Iterator[Pair]:
        """A vector that all terms are inner products with, and the sum of the others."""
        tried: list[Vector] = []
        pairs = [(t.coefficient, self.pairs.of(t.factors[0])) for t in linear]
        for vector in (v for pair in pairs[0][1] for v in pair):
            if vector in tried:
                continue
            tried.append(vector)
            parts: list[tuple[Coefficient, Vector]] = []
            for coefficient, found in pairs:
                others = [y if x is vector else x for x, y in found if vector in (x, y)]
                if not others:
                    break
                parts.append((coefficient, max(others, key=lambda v: v.number)))
            else:
                if len(parts) == 1 and parts[0][0].is_choice and parts[0][0].sides:
                    yield self.pairs.sum_of(parts), self.pairs.sum_of(((parts[0][0], vector),))
                plain = [c for c, _ in parts] == [ONE]
                yield parts[0][1] if plain else self.pairs.sum_of(parts), vector
                if len(tried) >= _TRIED:
                    return
