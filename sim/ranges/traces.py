"""Proof that the trace of a covariance stays limited, and of ranges that follow from that.

`sim.ranges.gram` has vectors p_i with P_ij = p_i . p_j. A rotation of P makes each of them a sum of
all, and no bound of one length survives it; a bound of the sum of squares, the trace T, does:

* sum_i |sum_k M_ik p_k|^2 <= |M|^2 T, |M| the spectral norm, which is that of a quaternion of
  which M is the matrix, or part of it; or no more than the Frobenius norm; of blocks, the largest;
* sqrt(sum_i |p_i + sum_k G_ik b_k|^2) <= sqrt(T) + |G| sqrt(T_b), where a state moves by others;
* a measurement makes each vector shorter, noise adds its variance, and a condition that compares
  the trace with a limit says that it is below.

States fall into blocks, each with a trace of its own. A limit of all of them is proven by
induction: the first matrix keeps it, and each next one if the previous one does. Inner products of
sums x = sum_k a_k p_k, y = sum_k b_k p_k are then at most T (|a| |b| + a . b) / 2, which is the
largest a^T P b of all covariances of trace T, and |x|^2 at most |a|^2 T.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from itertools import islice, product
from typing import Any

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.claims import Claim, Proof
from boresight.sim.ranges.coefficients import (
    ONE,
    Coefficient,
    Sides,
    all_sides,
    conditions_in,
    ends_of_sum,
)
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.inner_products import (
    POINTS,
    Full,
    Pair,
    Vector,
    flat_parts,
    made_from,
    of_unit,
)
from boresight.sim.ranges.norms import Norms
from boresight.sim.ranges.unit_vectors import Ball

__all__ = ["Traces"]

#: Updates after which limits of the traces have to be constant; most states whose blocks are tried.
_ROUNDS, _STATES = 12, 9
_ZERO = np.zeros(POINTS)
#: A sum of vectors: each with its coefficients, by number.
Row = dict[int, list[Coefficient]]


class Traces:
    """Limits of the traces of a compiled step; no proofs where there are none.

    Parameters
    ----------
    gram : Gram
        Of the same step.
    norms : Norms
        Of the same step.

    Attributes
    ----------
    limits : dict of tuple of int to float
        By the states of a block: the largest sum of their variances.
    """

    def __init__(self, gram: Gram, norms: Norms) -> None:
        self.gram, self.norms = gram, norms
        self.limits: dict[tuple[int, ...], float] = {}
        self.balls: dict[frozenset[int], Ball] = {}  # premises of norms
        self.totals: dict[Any, float] = {}
        if not gram.proven or gram.size > _STATES:
            return
        if not any(self._are_invariant(blocks) for blocks in _partitions(gram.size)):
            self.limits = {}

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from the limits of the traces."""
        way = self.gram.way(claim, self._ends) if self.limits else None
        if way is not None:
            return self._proof(claim.node, *way)
        for x, y in self._projected_pairs(claim.node) if self.limits else ():
            upper = math.sqrt(self._largest([x]) * self._largest([y]))
            if claim.holds(0.0 if x is y else -upper, upper):
                return self._proof(claim.node, (x, y), ())
        return None

    def _proof(self, node: Node, pair: Pair, rest: Sequence[Coefficient]) -> Proof:
        """The proof; its premises include those of the limits: all parts of the next matrix."""
        gram = self.gram
        premises = gram.premises_of(node, rest)
        for vectors in (pair, *((v, v) for v in gram.following)):
            premises.base |= gram.lengths.base_of(vectors, by_case=False)
        for ball in self.balls.values():
            premises.base |= {gram.nodes[n] for n in ball.used}
            premises.aliases |= ball.aliases
        return premises.proof("trace of a covariance", gram.nodes)

    def _projected_pairs(self, node: Node) -> Iterator[Pair]:
        """x and y of a sum of (x . u)(u . y), the u orthogonal: it is at most |x| |y|.

        Measurements that follow each other subtract such a sum from x . y: each is along a unit
        vector orthogonal to those of the others.
        """
        gram = self.gram
        terms = (gram.terms.of(node) or []) if node.number in gram.points.cone else []
        if not terms or any(t.coefficient != ONE or len(t.factors) != 2 for t in terms):
            return
        (first, second), *others = (t.factors for t in terms)
        for (x, u), (y, v) in product(self._oriented_pairs(first), self._oriented_pairs(second)):
            units = [u] if u is v and of_unit(u) else []
            for a, b in others if units else ():
                candidates = (
                    w
                    for _, w in self._oriented_pairs(a)
                    if of_unit(w)
                    and gram.pairs.is_product(a, (x, w))
                    and gram.pairs.is_product(b, (y, w))
                    and all(gram.space.is_pair((w, other), _ZERO, _ZERO) for other in units)
                )
                units += [*islice(candidates, 1)]
            if len(units) == len(terms):
                yield x, y

    def _oriented_pairs(self, node: Node) -> list[Pair]:
        """The pairs whose inner product a node is, in either order, with and without noise."""
        pairs = [way for x, y in self.gram.pairs.of(node) for way in ((x, y), (y, x))]
        forms = ((self._without_noise(x, y), *self._before_measurements(x, y)) for x, y in pairs)
        return [*dict.fromkeys((v, y) for (_, y), xs in zip(pairs, forms, strict=True) for v in xs)]

    def _before_measurements(self, v: Vector, other: Vector) -> Iterator[Vector]:
        """A vector, and the same before measurements along vectors orthogonal to another one."""
        yield v
        while v.unit is not None and v.parts[0][0] == ONE:
            if not self.gram.space.is_pair((v.unit, other), _ZERO, _ZERO):
                break
            v = v.parts[0][1]
            yield v

    # -- the limits -------------------------------------------------------------------------------

    def _are_invariant(self, blocks: Sequence[tuple[int, ...]]) -> bool:
        """Whether there are limits of the traces of blocks that an update keeps.

        They begin as the first traces, and grow to the largest traces after an update until nothing
        changes.
        """
        gram = self.gram
        variances = [v.variance for v in gram.space.vectors[: gram.size] if v.variance]
        initial = [self.norms.first[v.number] for v in variances]
        self.limits = {block: sum(initial[i] for i in block) for block in blocks}
        self.balls.clear()
        highest = {block: min(variances[i].high for i in block) for block in blocks}
        for _ in range(_ROUNDS):
            self.totals.clear()
            next_traces = {block: self._next(block) for block in blocks}
            if any(next_traces[b] > highest[b] for b in blocks):
                return False
            if all(next_traces[b] <= self.limits[b] for b in blocks):
                return True
            self.limits = {b: max(next_traces[b], self.limits[b]) for b in blocks}
        return False

    def _next(self, block: Sequence[int]) -> float:
        """Largest next trace of a block."""
        vectors = [self.gram.following[i] for i in block]
        return self._largest(vectors)

    def _largest(self, vectors: Sequence[Vector]) -> float:
        """Largest sum of squared lengths, over the sides of conditions."""
        return max(self._total(vectors, sides) for sides in all_sides(_conditions(vectors)))

    # -- sums of squared lengths ------------------------------------------------------------------

    def _total(self, vectors: Sequence[Vector], sides: Sides) -> float:
        """Upper bound of a sum of squared lengths, on the given sides."""
        key = tuple(sorted(v.number for v in vectors)), tuple(sorted(sides.items()))
        if key not in self.totals:
            self.totals[key] = self._new_total(vectors, sides)
        return self.totals[key]

    def _new_total(self, vectors: Sequence[Vector], sides: Sides) -> float:
        """Compute the bound."""
        if len({v.number for v in vectors}) < len(vectors):
            return sum(self._total([v], sides) for v in vectors)
        noise, plain = 0.0, list[Vector]()
        for v in vectors:
            while v.noise or v.unit is not None:  # longer by noise, shorter by a measurement
                if v.noise:
                    noise += v.largest_noise(sides)
                if len(v.parts) != 1 or v.parts[0][0] != ONE:
                    break
                v = v.parts[0][1]
            plain.append(v)
        if all(v.variance is not None for v in plain):
            return noise + self._states(plain, sides)
        if len({v.number for v in plain}) < len(plain):
            return noise + sum(self._total([v], sides) for v in plain)
        units = [v for v in plain if not v.parts and v.variance is None]
        square = sum(self._unit_square(v) for v in units)
        rows = [self._row(v, sides) for v in plain if v.parts or v.variance is not None]
        return noise + square + self._total_of_rows(rows, sides)

    def _unit_square(self, v: Vector) -> float:
        """Squared length of a unit vector."""
        return 1.0 if v.measured is not None else math.inf

    def _states(self, vectors: Sequence[Vector], sides: Sides) -> float:
        """The same for vectors of the previous matrix, by their limits and by conditions."""
        total = 0.0
        for block, limit in self.limits.items():
            members = {v.number for v in vectors if v.number in block}
            if members:
                upper = limit
                for squares, rest in self.gram.terms.limits_on(sides):
                    if members <= squares.keys():
                        upper = min(upper, max(0.0, rest / min(squares[n] for n in members)))
                total += upper
        return total

    def _row(self, v: Vector, sides: Sides) -> Row:
        """A vector as a sum of others, on the given sides."""
        row: Row = {}
        if v.variance is not None:
            return {v.number: [ONE]}
        for c, part in flat_parts(v.parts):
            if not c.number or any(sides.get(n, s) != s for n, s in c.sides):
                continue
            open_sides = frozenset((n, s) for n, s in c.sides if n not in sides)
            row.setdefault(part.number, []).append(Coefficient(c.number, c.nodes, open_sides))
        return row

    def _total_of_rows(self, rows: Sequence[Row], sides: Sides) -> float:
        """Upper bound of the sum of squared lengths of rows."""
        plain = {next(iter(row)) for row in rows if [*row.values()] == [[ONE]]}
        others = [row for row in rows if row and [*row.values()] != [[ONE]]]
        parts = _parts_of(others)
        square = self._total_of(plain, sides) if plain else 0.0
        square += sum(self._coupled(part, sides) for part in parts)
        numbers = [*plain, *(n for part in parts for n in {n for row in part for n in row})]
        if parts and plain:
            square = min(square, self._coupled([row for row in rows if row], sides))
        if not parts or len(parts) + bool(plain) == 1 or len({*numbers}) < len(numbers):
            return square
        norm = max(float(bool(plain)), *(self._norm(part, sides) for part in parts))
        return min(square, norm * norm * self._total_of(numbers, sides))

    def _coupled(self, rows: Sequence[Row], sides: Sides) -> float:
        """The same for rows with common vectors."""
        identity: dict[int, int] = {}
        increments: list[Row] = []
        for k, row in enumerate(rows):  # a vector itself, and the rest
            base = next((n for n, c in row.items() if c == [ONE] and n not in identity), None)
            if base is not None:
                identity[base] = k
            increments.append({n: c for n, c in row.items() if n != base})
        length = math.sqrt(self._total_of(identity, sides)) if identity else 0.0
        if any(increments):
            length += self._norm(increments, sides) * math.sqrt(self._columns(increments, sides))
        square = self._norm(rows, sides) ** 2 * self._columns(rows, sides)
        return min(length * length, square)

    def _columns(self, rows: Sequence[Row], sides: Sides) -> float:
        return self._total_of({n for row in rows for n in row}, sides)

    def _total_of(self, numbers: Collection[int], sides: Sides) -> float:
        return self._total([self.gram.space.vectors[n] for n in sorted(numbers)], sides)

    def _norm(self, rows: Sequence[Row], sides: Sides) -> float:
        """Upper bound of the spectral norm of a matrix of coefficients."""
        square = 0.0  # Frobenius
        for row in rows:
            for coefficients in row.values():
                low, high = ends_of_sum(coefficients, sides)
                square += max(low * low, high * high)
        matrix = _matrix([row for row in rows if row])
        if matrix is not None:
            bound, ball = self.norms.square_of(matrix)
            if ball is not None and bound < square:
                self.balls[ball.used | ball.aliases] = ball
                square = bound
        return math.sqrt(square)

    # -- inner products ---------------------------------------------------------------------------

    def _ends(self, pair: Pair, rest: Sequence[Coefficient]) -> tuple[float, float]:
        """Ends of an inner product and a rest, over the sides of conditions."""
        x, y = pair
        conditions = _conditions([x, y], rest)
        low, high = math.inf, -math.inf
        for sides in all_sides(conditions):
            bound = self._product(x, y, sides)
            rest_low, rest_high = ends_of_sum(rest, sides)
            low = min(low, (0.0 if x is y else -bound) + rest_low)
            high = max(high, bound + rest_high)
        return low, high

    def _product(self, x: Vector, y: Vector, sides: Sides) -> float:
        """Largest magnitude of an inner product."""
        if x is y:
            return self._total([x], sides)
        variants = ({x, self._without_noise(x, y)}, {y, self._without_noise(y, x)})
        return min(self._of_different(a, b, sides) for a in variants[0] for b in variants[1])

    def _without_noise(self, v: Vector, other: Vector) -> Vector:
        """A vector without noise of which another one has no part, also before measurements."""
        value = np.einsum("ij,ij->i", v.at, other.at)
        try:
            plain = self.gram.space.without_noise(v)
        except Full:
            return v
        return plain if self.gram.space.is_pair((plain, other), value, abs(value)) else v

    def _of_different(self, x: Vector, y: Vector, sides: Sides) -> float:
        """The same for two different vectors."""
        upper = math.sqrt(self._total([x], sides) * self._total([y], sides))
        units = {v.unit.number for v in (x, y) if v.unit is not None}
        rows = [self._row_of(v, sides, len(units) < 2) for v in (x, y)]
        numbers = {n for row in rows for n in row}
        if len(numbers) < 2 or any(len(c) != 1 for row in rows for c in row.values()):
            return upper
        lengths = [self._norm([row], sides) for row in rows]
        dot = 0.0
        for n in rows[0].keys() & rows[1].keys():
            ends = rows[0][n][0].times(rows[1][n][0]).ends(sides)
            dot += max(-ends[0], ends[1])
        bound = 0.5 * (lengths[0] * lengths[1] + dot)  # the largest a^T P b of trace one
        return min(upper, bound * self._total_of(numbers, sides))

    def _row_of(self, v: Vector, sides: Sides, same_unit: bool) -> Row:
        """A vector as a sum of others, after the same measurement if both have the ``same_unit``.

        If it is along u, x - (x . u) u and y have the same inner product as both without their
        parts along u.
        """
        if same_unit and v.unit is not None and not v.unit.share and v.parts[0][0] == ONE:
            v = v.parts[0][1]
        if v.parts and not v.noise and v.unit is None:
            return self._row(v, sides)
        return {v.number: [ONE]}


def _partitions(size: int) -> Iterator[list[tuple[int, ...]]]:
    """All states in one block, or the first ones in one and the others in another."""
    for k in range(size):
        blocks = (tuple(range(k)), tuple(range(k, size)))
        yield [block for block in blocks if block]


def _conditions(vectors: Sequence[Vector], rest: Sequence[Coefficient] = ()) -> set[int]:
    """Conditions, by number, on whose sides the lengths of vectors or a rest may depend."""
    coefficients = [*rest]
    for v in made_from(vectors):
        coefficients += [*v.noise, *(c for c, _ in v.parts)]
    conditions = {n for c in coefficients for n, _ in c.sides}
    return conditions.union(*(conditions_in(node) for c in coefficients for node in c.nodes))


def _parts_of(rows: Sequence[Row]) -> list[list[Row]]:
    """Groups of rows with common vectors, directly or through other rows."""
    parts: list[list[Row]] = []
    for row in rows:
        overlapping = [part for part in parts if any(row.keys() & other.keys() for other in part)]
        parts = [part for part in parts if part not in overlapping]
        parts.append([r for part in overlapping for r in part] + [row])
    return parts


def _matrix(rows: Sequence[Row]) -> list[list[Coefficient | None]] | None:
    """Coefficients by row and vector; None if some are sums or depend on conditions."""
    numbers = sorted({n for row in rows for n in row})
    sums = [c for row in rows for c in row.values()]
    if not sums or any(len(c) != 1 or c[0].sides or len(c[0].nodes) > 1 for c in sums):
        return None
    return [[row[n][0] if n in row else None for n in numbers] for row in rows]
