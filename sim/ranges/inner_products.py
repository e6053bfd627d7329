"""Vectors and their inner products at random points.

An identity of polynomials is checked at the points: all of them would have to be roots of a false
one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient, Sides, ends_of_sum

__all__ = [
    "POINTS",
    "FloatArray",
    "Full",
    "Pair",
    "Parts",
    "Space",
    "Vector",
    "by_vector",
    "flat_parts",
    "is_scaled",
    "made_from",
    "of_unit",
]

FloatArray = npt.NDArray[np.float64]
#: Random points, and those that are tried first.
POINTS, _FIRST = 512, 32
#: Share of the terms by which an identity may fail at a point by rounding; terms larger than the
#: product of the lengths count up to this multiple of it.
_EXACT, _CANCELLED = 1e-12, 1e4
#: Vectors of one step.
_VECTORS = 900


@dataclass(eq=False)
class Vector:
    """One vector.

    Attributes
    ----------
    number : int
    at : (points, dimensions) array
    length : (points,) array
    parts : tuple of (Coefficient, Vector)
        Terms of the sum that it is; less its part along ``unit``, if there is one.
    noise : tuple of Coefficient
        Terms of the squared component in a direction of its own.
    unit : Vector or None
    variance : Node or None
        The state that is its squared length, of a vector of the matrix before.
    measured : Vector or None
        Of a unit vector: the vector along which it is.
    share : bool
        Whether it is shorter than one: sqrt(k) m of P - k (P h)(P h)^T, k = w / (w |m|^2 + v).
    copied : bool
        Whether it is a copy of another one, in directions that only such copies have.
    noise_roots : dict of int to (points,) array
        Of a vector with noise: the roots of its noise in directions that others may share.
    noisy : Vector or None
        The latest vector that is this one with noise.
    remainders : list of Vector
        This one after measurements.
    of_measurement : bool
        Whether it has the noise of a measurement, which no element has.
    """

    number: int
    at: FloatArray = field(repr=False)
    length: FloatArray = field(repr=False)
    parts: tuple[tuple[Coefficient, Vector], ...] = ()
    noise: tuple[Coefficient, ...] = ()
    unit: Vector | None = None
    variance: Node | None = None
    measured: Vector | None = None
    share: bool = False
    copied: bool = False
    noise_roots: dict[int, FloatArray] = field(default_factory=dict, repr=False)
    noisy: Vector | None = field(default=None, repr=False)
    remainders: list[Vector] = field(default_factory=list, repr=False)
    of_measurement: bool = False
    conditions: frozenset[int] = field(init=False)

    def __post_init__(self) -> None:
        self.conditions = frozenset(n for c in self.coefficients for n, _ in c.sides).union(
            *(v.conditions for _, v in self.parts)
        )

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """Coefficients of its parts and of its noise."""
        return (*(c for c, _ in self.parts), *self.noise)

    def largest_noise(self, sides: Sides) -> float:
        """Largest squared component in a direction of its own, on the given sides."""
        return max(0.0, ends_of_sum(self.noise, sides)[1])


#: Vectors times coefficients.
Parts = Sequence[tuple[Coefficient, Vector]]
Pair = tuple[Vector, Vector]


class Space:
    """Vectors at the points, each once, and their inner products."""

    def __init__(self, dimensions: int) -> None:
        rng = np.random.default_rng(2)
        self.dimensions, self.used = dimensions, 0
        self.vectors: list[Vector] = []
        self._copies: dict[int, int] = {}
        self.weights = rng.uniform(0.5, 1.5, _FIRST) * rng.choice([-1.0, 1.0], _FIRST)
        self.flat = np.zeros((16, _FIRST * dimensions))
        self.sums = np.zeros((16, dimensions))
        self.table = np.zeros((16, 16))

    def direction(self) -> int:
        """A direction that no vector has."""
        if self.used >= self.dimensions:
            raise Full
        self.used += 1
        return self.used - 1

    def copy(self, v: Vector) -> Vector:
        """A copy in directions of its own; copies have the inner products of the originals."""
        at = np.zeros((POINTS, self.dimensions))
        for direction in np.flatnonzero(v.at.any(axis=0)).tolist():
            if direction not in self._copies:
                self._copies[direction] = self.direction()
            at[:, self._copies[direction]] = v.at[:, direction]
        return self.add(at, parts=((ONE, v),), copied=True)

    def find(self, at: FloatArray) -> Vector | None:
        """The vector that equals an array (points, dimensions), if there is one."""
        key, size = self.weights @ at[:_FIRST], _lengths(at)
        scale = 1e-9 * (abs(self.weights) @ size[:_FIRST])
        for k in np.flatnonzero(abs(self.sums[: len(self.vectors)] - key).max(axis=1) <= scale):
            if (abs(self.vectors[k].at - at).max(axis=1) <= 10.0 * _EXACT * size).all():
                return self.vectors[k]
        return None

    def add(self, at: FloatArray, **fields: Any) -> Vector:
        """Add a vector (points, dimensions or fewer), or return the one that equals it."""
        padded = np.zeros((POINTS, self.dimensions))
        padded[:, : at.shape[1]] = at
        if (existing := self.find(padded)) is not None:
            return existing
        count, first_points = len(self.vectors), padded[:_FIRST]
        if count >= _VECTORS:
            raise Full
        if count == len(self.flat):
            self.flat = np.concatenate([self.flat, np.zeros_like(self.flat)])
            self.sums = np.concatenate([self.sums, np.zeros_like(self.sums)])
            table = np.zeros((2 * count, 2 * count))
            table[:count, :count] = self.table
            self.table = table
        vector = Vector(count, padded, _lengths(padded), **fields)
        self.vectors.append(vector)
        self.flat[count], self.sums[count] = first_points.ravel(), self.weights @ first_points
        products = self.flat[: count + 1] @ (self.weights[:, None] * first_points).ravel()
        self.table[count, : count + 1] = self.table[: count + 1, count] = products
        return vector

    def remainder(self, v: Vector, unit: Vector) -> Vector:
        """A vector less its part along another one; less a ``share`` s: v - b (v . s) s.

        With b = (1 - sqrt(1 - |s|^2)) / |s|^2 all inner products x . y are less by (x . s)(s . y).
        """
        along = np.einsum("ij,ij->i", v.at, unit.at)
        if unit.share:
            square = unit.length * unit.length
            root = np.sqrt(np.maximum(1.0 - square, 0.0))
            along = along / (1.0 + root)
        reduced = self.add(v.at - along[:, None] * unit.at, parts=((ONE, v),), unit=unit)
        if reduced is not v and reduced not in v.remainders:
            v.remainders.append(reduced)
        return reduced

    def without_noise(self, v: Vector) -> Vector:
        """A vector without its latest noise, before measurements or after."""
        if len(v.parts) != 1 or v.parts[0][0] != ONE or (v.unit is not None and v.unit.share):
            return v
        inner = v.parts[0][1]
        if v.noise or v.unit is None:
            return inner if v.noise else v
        plain = self.without_noise(inner)
        return v if plain is inner else self.remainder(plain, v.unit)

    def pairs(self, value: FloatArray, size: FloatArray, start: int) -> Iterator[Pair]:
        """Pairs whose inner product is a value, with one vector numbered ``start`` or higher."""
        count = len(self.vectors)
        if start >= count or not value.any():
            return
        key = self.weights @ value[:_FIRST]
        table = self.table[start:count, :count]
        scale = 1e-8 * (abs(self.weights) @ abs(value[:_FIRST]))
        for i, j in zip(*np.nonzero(abs(table - key) <= scale), strict=True):
            pair = self.vectors[start + i], self.vectors[j]
            if (j <= start + i) and self.is_pair(pair, value, size):
                yield pair

    @staticmethod
    def is_pair(pair: Pair, value: FloatArray, size: FloatArray) -> bool:
        """Whether an inner product is a value."""
        x, y = pair
        for part in (slice(_FIRST), slice(_FIRST, None)):
            error = abs(np.einsum("ij,ij->i", x.at[part], y.at[part]) - value[part])
            bound = x.length[part] * y.length[part]
            if (error > _EXACT * (np.minimum(size[part], _CANCELLED * bound) + bound)).any():
                return False
        return True


def _lengths(at: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", at, at)))


class Full(Exception):
    """More vectors or directions than there is room for."""


def is_scaled(v: Vector) -> bool:
    """Whether a vector is another one, times a coefficient."""
    return len(v.parts) == 1 and v.unit is None and not v.noise


def of_unit(v: Vector) -> bool:
    """Whether a vector is of length one, or zero."""
    if v.measured is not None:
        return True
    return is_scaled(v) and v.parts[0][0].is_choice and of_unit(v.parts[0][1])


def flat_parts(parts: Parts) -> Iterator[tuple[Coefficient, Vector]]:
    """A sum of vectors, with its parts that are sums expanded."""
    for c, v in parts:
        if v.parts and v.unit is None and not v.noise and not v.copied:
            yield from flat_parts([(c.times(inner), part) for inner, part in v.parts])
        else:
            yield c, v


def by_vector(parts: Iterable[tuple[Coefficient, Vector]]) -> dict[Vector, list[Coefficient]]:
    """The coefficients of each vector of a sum."""
    out: dict[Vector, list[Coefficient]] = {}
    for c, v in parts:
        out.setdefault(v, []).append(c)
    return out


def made_from(
    vectors: Iterable[Vector],
    parts: Callable[[Vector], Iterable[tuple[Coefficient, Vector]]] = lambda v: v.parts,
) -> Iterator[Vector]:
    """Vectors and all that they are made from, each once."""
    stack, visited = [*vectors], set[int]()
    while stack:
        v = stack.pop()
        if v.number not in visited:
            visited.add(v.number)
            yield v
            stack += [part for _, part in parts(v)]
            stack += [] if v.unit is None or v.unit.measured is None else [v.unit.measured]
