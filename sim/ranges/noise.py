"""Noise of variances: the directions that it adds to vectors.

Noise q of a variance |p|^2 is a new direction, p + sqrt(q) e. Two variances whose noise has terms
w a^2 and w b^2 share the direction, if their covariance has noise w a b.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient, all_sides, ends_of_sum
from boresight.sim.ranges.inner_products import FloatArray, Vector
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.points import Points

__all__ = ["minimum_of", "with_noise"]

#: Terms of a polynomial, and steps back.
_TERMS, _BACK = 400, 8
#: Share by which a product of two roots may differ from a covariance of noise: rounding.
_ALIKE = 1e-12


def with_noise(pairs: Pairs, v: Vector, noise: tuple[Coefficient, ...]) -> Vector | None:
    """A vector with the root of noise in a new direction; None: the noise may be negative."""
    square = pairs.points.total(noise)
    if (square < 0.0).any() or minimum_of(noise) < 0.0:
        return None
    if not square.any():
        return v
    for other in pairs.space.vectors:
        if other.noise == noise and other.parts == ((ONE, v),):
            return other
    at = np.zeros_like(v.at)
    at[:] = v.at
    along = _directions_of(pairs, v, noise)
    for direction, root in along.items():
        at[:, direction] = root
        square = square - root * root
    at[:, pairs.space.direction()] = np.sqrt(np.maximum(square, 0.0))
    v.noisy = pairs.space.add(at, parts=((ONE, v),), noise=noise)
    v.noisy.noise_roots = along
    return v.noisy


def _directions_of(pairs: Pairs, v: Vector, noise: Sequence[Coefficient]) -> dict[int, FloatArray]:
    """Roots of the terms w a^2 of a noise, by direction: a new one, or one shared with others.

    A shared direction has no part of v yet: squared lengths add up.
    """
    out: dict[int, FloatArray] = {}
    for root in _roots(pairs.points, noise):
        candidates = (
            (direction, sign * root)
            for other, covariance in _common_noise(pairs, v)
            for direction, other_root in other.noise_roots.items()
            for sign in (1.0, -1.0)
            if np.allclose(sign * root * other_root, covariance, rtol=_ALIKE, atol=0.0)
            if direction not in out and not v.at[:, direction].any()
        )
        direction, root = next(candidates, (-1, root))
        out[pairs.space.direction() if direction < 0 else direction] = root
    return out


def _common_noise(pairs: Pairs, v: Vector) -> Iterator[tuple[Vector, FloatArray]]:
    """Vectors with noise, and the noise of their inner products with v."""
    for products, rest in pairs.sums.values():
        for x, y in products if rest else ():
            other = y if x is v else x
            if other is not v and v in (x, y):
                yield other.noisy or other, pairs.points.total(rest)


def _roots(points: Points, noise: Sequence[Coefficient]) -> list[FloatArray]:
    """sqrt(w) a of the terms w a^2; empty if a term of the noise may be negative."""
    nodes, values = points.nodes, points.values
    roots: list[FloatArray] = []
    base: set[Node] = set()
    for c in noise:
        form = c.polynomial(_TERMS, _BACK, points.bounded)
        if form is None:
            return []
        indicator = points.at(Coefficient(sides=c.sides))
        for m, factor in form.items():
            odd = [nodes[n] for n in {*m} if m.count(n) % 2]
            if factor <= 0.0 or any(n.low < 0.0 for n in odd):
                return []
            base |= {*odd}
            roots_of_squares = [values[n] for n in {*m} for _ in range(m.count(n) // 2)]
            if roots_of_squares:
                square = factor * math.prod((values[n.number] for n in odd), start=indicator)
                roots.append(math.prod(roots_of_squares, start=np.sqrt(square)))
    points.premises.base |= base if roots else set()
    return roots


def minimum_of(noise: Sequence[Coefficient]) -> float:
    """Least value of a sum, over the sides of its conditions."""
    conditions = {n for c in noise for n, _ in c.sides}
    return min(ends_of_sum(noise, sides)[0] for sides in all_sides(conditions))
