"""Vectors whose inner products the nodes of a step are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import Coefficient
from boresight.sim.ranges.inner_products import POINTS, FloatArray, Pair, Parts, Space, Vector
from boresight.sim.ranges.points import Points

__all__ = ["Pairs"]

#: Most pairs of one value.
_PAIRS = 4


@dataclass(frozen=True)
class Weight:
    """w and v of w / (w |m|^2 + v): of a measurement of variance v / w."""

    factor: Coefficient
    noise: tuple[Coefficient, ...]


class Pairs:
    """The pairs of vectors, by node.

    Parameters
    ----------
    space, points
        The vectors, and the values of the nodes.

    Attributes
    ----------
    by_node : dict of int to list of Pair
        The pairs whose inner product a node is.
    sums : dict of int to (list of Pair, tuple of Coefficient)
        The pairs whose inner product is a node less a rest, and the rest.
    units : dict of int to (list of Vector, Vector)
        Of an inverse root 1 / |m|, by its node: m, with and without noise, and m / |m|.
    weights : dict of (Coefficient, Vector) to Weight
        Of k, and of m.
    """

    def __init__(self, space: Space, points: Points) -> None:
        self.space, self.points = space, points
        self.by_node: dict[int, list[Pair]] = {}
        self.sums: dict[int, tuple[list[Pair], tuple[Coefficient, ...]]] = {}
        self.units: dict[int, tuple[list[Vector], Vector]] = {}
        self.weights: dict[tuple[Coefficient, Vector], Weight] = {}
        self._searched: dict[int, int] = {}  # how many vectors have been tried

    def of(self, node: Node) -> list[Pair]:
        """Vectors whose inner product a node is: the latest, with all noise."""
        found = self.by_node.setdefault(node.number, [])
        start = self._searched.get(node.number, 0)
        if node.number in self.points.cone and start < len(self.space.vectors):
            value, size = self.points.values[node.number], self.points.sizes[node.number]
            found[:] = self.latest(value, size, start, found)
            self._searched[node.number] = len(self.space.vectors)
        return found

    def roots_of(self, node: Node) -> list[Vector]:
        """Vectors whose squared length a node is."""
        return [x for x, y in self.of(node) if x is y]

    def ways(self, node: Node) -> Iterator[tuple[Pair, Sequence[Coefficient]]]:
        """Pairs whose inner product, with a rest, a node is."""
        yield from ((pair, ()) for pair in self.of(node))
        pairs, rest = self.sums.get(node.number, ([], ()))
        yield from ((pair, rest) for pair in pairs)

    def is_product(self, node: Node, pair: Pair) -> bool:
        """Whether a node is the inner product of two vectors."""
        points = self.points
        return self.space.is_pair(pair, points.values[node.number], points.sizes[node.number])

    def sum_of(self, parts: Parts) -> Vector:
        """The sum of vectors times coefficients."""
        terms = (self.points.at(c)[:, None] * v.at for c, v in parts)
        return self.space.add(sum(terms, np.zeros((POINTS, 1))), parts=tuple(parts))

    def latest(
        self, value: FloatArray, size: FloatArray, start: int = 0, known: Sequence[Pair] = ()
    ) -> list[Pair]:
        """Pairs whose inner product is a value, the latest first."""
        candidates = [
            pair
            for pair in self.space.pairs(value, size, start)
            if not any(v.of_measurement for v in pair)
        ]
        candidates += (self._less_noise(pair, value, size) for pair in known)
        out = [*dict.fromkeys(self._latest_form(pair, value, size) for pair in candidates)]
        out.sort(key=lambda pair: -pair[0].number - pair[1].number)
        return out[:_PAIRS]

    def _less_noise(self, pair: Pair, value: FloatArray, size: FloatArray) -> Pair:
        """A pair without noise that is now known to belong to a measurement."""
        x, y = (self.space.without_noise(v) if v.of_measurement else v for v in pair)
        return (x, y) if self.space.is_pair((x, y), value, size) else pair

    def _latest_form(self, pair: Pair, value: FloatArray, size: FloatArray) -> Pair:
        """A pair with the noise of its vectors, and after measurements, where that is the same."""
        x, y = (v.noisy if v.noisy and not v.noisy.of_measurement else v for v in pair)
        x, y = (x, y) if self.space.is_pair((x, y), value, size) else pair
        later: Pair | None = (x, y)
        while later is not None:
            x, y = later
            ways = (*((v, y) for v in x.remainders), *((x, v) for v in y.remainders))
            later = next((way for way in ways if self.space.is_pair(way, value, size)), None)
        return (x, y) if x.number >= y.number else (y, x)
