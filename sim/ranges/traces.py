"""Proof that the trace of a covariance stays limited, and of ranges that follow from that.

`sim.ranges.gram` has vectors p_i with P_ij = p_i . p_j. A rotation of P makes each of them a sum of
all, and no bound of one length survives it; the sum of squared lengths, the trace T, does:

* sum_i |sum_k M_ik p_k|^2 <= |M|^2 T, |M| the spectral norm, which is that of a quaternion of
  which M is the matrix, or part of it; or no more than the Frobenius norm; of blocks, the largest;
* sqrt(sum_i |p_i + sum_k G_ik b_k|^2) <= sqrt(T) + |G| sqrt(T_b), where a state moves by others;
* a measurement makes each vector shorter, noise adds its variance, and a condition that compares
  the trace with a limit says that it is below.

States fall into blocks, each with a trace of its own. A limit of all of them is proven by
induction: the first matrix keeps it, and the next one does if the one before did. Inner products of
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

#: Updates after which limits of the traces have to repeat themselves; states of which blocks are
#: tried.
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
        self.balls: dict[frozenset[int], Ball] = {}  # of which norms follow
        self.totals: dict[Any, float] = {}
        if not gram.proven or gram.size > _STATES:
            return
        if not any(self._are_kept(blocks) for blocks in _partitions(gram.size)):
            self.limits = {}

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from the limits of the traces."""
        way = self.gram.way(claim, self._ends) if self.limits else None
        if way is not None:
            return self._proof(claim.node, *way)
        for x, y in self._taken(claim.node) if self.limits else ():
            most = math.sqrt(self._largest([x]) * self._largest([y]))
            if claim.holds(0.0 if x is y else -most, most):
                return self._proof(claim.node, (x, y), ())
        return None

    def _proof(self, node: Node, pair: Pair, rest: Sequence[Coefficient]) -> Proof:
        """It rests on what the limits rest on: on all that the next matrix is made of."""
        gram = self.gram
        rests_on = gram.behind(node, rest)
        for each in (pair, *((v, v) for v in gram.following)):
            rests_on.base |= gram.lengths.base_of(each, by_case=False)
        for ball in self.balls.values():
            rests_on.base |= {gram.nodes[n] for n in ball.used}
            rests_on.passed |= ball.passed
        return rests_on.proof("trace of a covariance", gram.nodes)

    def _taken(self, node: Node) -> Iterator[Pair]:
        """x and y of a sum of (x . u)(u . y), the u orthogonal: it is at most |x| |y|.

        So is what measurements take of x . y, one after the other: each is along what is orthogonal
        to what the others are along.
        """
        gram = self.gram
        terms = (gram.terms.of(node) or []) if node.number in gram.points.cone else []
        if not terms or any(t.coefficient != ONE or len(t.factors) != 2 for t in terms):
            return
        (first, second), *others = (t.factors for t in terms)
        for (x, u), (y, v) in product(self._both(first), self._both(second)):
            units = [u] if u is v and of_unit(u) else []
            for a, b in others if units else ():
                found = (
                    w
                    for _, w in self._both(a)
                    if of_unit(w)
                    and gram.pairs.is_product(a, (x, w))
                    and gram.pairs.is_product(b, (y, w))
                    and all(gram.space.is_pair((w, other), _ZERO, _ZERO) for other in units)
                )
                units += [*islice(found, 1)]
            if len(units) == len(terms):
                yield x, y

    def _both(self, node: Node) -> list[Pair]:
        """The pairs whose inner product a node is, in either order, with and without noise."""
        ways = [way for x, y in self.gram.pairs.of(node) for way in ((x, y), (y, x))]
        each = ((self._without_noise(x, y), *self._before(x, y)) for x, y in ways)
        return [*dict.fromkeys((v, y) for (_, y), own in zip(ways, each, strict=True) for v in own)]

    def _before(self, v: Vector, other: Vector) -> Iterator[Vector]:
        """A vector, and what it was before measurements along what another one is orthogonal to."""
        yield v
        while v.unit is not None and v.parts[0][0] == ONE:
            if not self.gram.space.is_pair((v.unit, other), _ZERO, _ZERO):
                break
            v = v.parts[0][1]
            yield v

    # -- the limits -------------------------------------------------------------------------------

    def _are_kept(self, blocks: Sequence[tuple[int, ...]]) -> bool:
        """Whether limits of the traces of blocks follow for the next matrix from themselves.

        They begin as the first traces, and become what an update can make of them until nothing
        changes.
        """
        gram = self.gram
        variances = [v.variance for v in gram.space.vectors[: gram.size] if v.variance]
        first = [self.norms.first[v.number] for v in variances]
        self.limits = {block: sum(first[i] for i in block) for block in blocks}
        self.balls.clear()
        highest = {block: min(variances[i].high for i in block) for block in blocks}
        for _ in range(_ROUNDS):
            self.totals.clear()
            after = {block: self._next(block) for block in blocks}
            if any(after[b] > highest[b] for b in blocks):
                return False
            if all(after[b] <= self.limits[b] for b in blocks):
                return True
            self.limits = {b: max(after[b], self.limits[b]) for b in blocks}
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
            self.totals[key] = self._summed(vectors, sides)
        return self.totals[key]

    def _summed(self, vectors: Sequence[Vector], sides: Sides) -> float:
        """The same, anew."""
        if len({v.number for v in vectors}) < len(vectors):
            return sum(self._total([v], sides) for v in vectors)
        noise, plain = 0.0, list[Vector]()
        for v in vectors:
            while v.noise or v.unit is not None:  # longer by noise, shorter by a measurement
                if v.noise:
                    noise += v.most_noise(sides)
                if len(v.parts) != 1 or v.parts[0][0] != ONE:
                    break
                v = v.parts[0][1]
            plain.append(v)
        if all(v.variance is not None for v in plain):
            return noise + self._states(plain, sides)
        if len({v.number for v in plain}) < len(plain):
            return noise + sum(self._total([v], sides) for v in plain)
        alone = [v for v in plain if not v.parts and v.variance is None]
        square = sum(self._alone(v) for v in alone)
        rows = [self._row(v, sides) for v in plain if v.parts or v.variance is not None]
        return noise + square + self._sums(rows, sides)

    def _alone(self, v: Vector) -> float:
        """Squared length of a unit vector."""
        return 1.0 if v.measured is not None else math.inf

    def _states(self, vectors: Sequence[Vector], sides: Sides) -> float:
        """Of vectors of the matrix before: by the limits, and by what conditions say."""
        total = 0.0
        for block, limit in self.limits.items():
            chosen = {v.number for v in vectors if v.number in block}
            if chosen:
                most = limit
                for squares, rest in self.gram.terms.limits_on(sides):
                    if chosen <= squares.keys():
                        most = min(most, max(0.0, rest / min(squares[n] for n in chosen)))
                total += most
        return total

    def _row(self, v: Vector, sides: Sides) -> Row:
        """A vector as a sum of others, on the given sides."""
        row: Row = {}
        if v.variance is not None:
            return {v.number: [ONE]}
        for c, part in flat_parts(v.parts):
            if not c.number or any(sides.get(n, s) != s for n, s in c.sides):
                continue
            left = frozenset((n, s) for n, s in c.sides if n not in sides)
            row.setdefault(part.number, []).append(Coefficient(c.number, c.nodes, left))
        return row

    def _sums(self, rows: Sequence[Row], sides: Sides) -> float:
        """Of sums of vectors."""
        alone = {next(iter(row)) for row in rows if [*row.values()] == [[ONE]]}
        others = [row for row in rows if row and [*row.values()] != [[ONE]]]
        parts = _parts_of(others)
        square = self._numbered(alone, sides) if alone else 0.0
        square += sum(self._joined(part, sides) for part in parts)
        numbers = [*alone, *(n for part in parts for n in {n for row in part for n in row})]
        if parts and alone:
            square = min(square, self._joined([row for row in rows if row], sides))
        if not parts or len(parts) + bool(alone) == 1 or len({*numbers}) < len(numbers):
            return square
        norm = max(float(bool(alone)), *(self._norm(part, sides) for part in parts))
        return min(square, norm * norm * self._numbered(numbers, sides))

    def _joined(self, rows: Sequence[Row], sides: Sides) -> float:
        """Of sums that have vectors in common."""
        same: dict[int, int] = {}
        moved: list[Row] = []
        for k, row in enumerate(rows):  # a vector itself, and what is added
            own = next((n for n, c in row.items() if c == [ONE] and n not in same), None)
            if own is not None:
                same[own] = k
            moved.append({n: c for n, c in row.items() if n != own})
        apart = math.sqrt(self._numbered(same, sides)) if same else 0.0
        if any(moved):
            apart += self._norm(moved, sides) * math.sqrt(self._columns(moved, sides))
        whole = self._norm(rows, sides) ** 2 * self._columns(rows, sides)
        return min(apart * apart, whole)

    def _columns(self, rows: Sequence[Row], sides: Sides) -> float:
        return self._numbered({n for row in rows for n in row}, sides)

    def _numbered(self, numbers: Collection[int], sides: Sides) -> float:
        return self._total([self.gram.space.vectors[n] for n in sorted(numbers)], sides)

    def _norm(self, rows: Sequence[Row], sides: Sides) -> float:
        """Upper bound of the spectral norm of a matrix of coefficients."""
        square = 0.0  # Frobenius
        for row in rows:
            for each in row.values():
                low, high = ends_of_sum(each, sides)
                square += max(low * low, high * high)
        matrix = _matrix([row for row in rows if row])
        if matrix is not None:
            known, found = self.norms.square_of(matrix)
            if found is not None and known < square:
                self.balls[found.used | found.passed] = found
                square = known
        return math.sqrt(square)

    # -- inner products ---------------------------------------------------------------------------

    def _ends(self, pair: Pair, rest: Sequence[Coefficient]) -> tuple[float, float]:
        """Ends of an inner product and a rest, over the sides of conditions."""
        x, y = pair
        conditions = _conditions([x, y], rest)
        low, high = math.inf, -math.inf
        for sides in all_sides(conditions):
            most = self._product(x, y, sides)
            least, largest = ends_of_sum(rest, sides)
            low = min(low, (0.0 if x is y else -most) + least)
            high = max(high, most + largest)
        return low, high

    def _product(self, x: Vector, y: Vector, sides: Sides) -> float:
        """Largest magnitude of an inner product."""
        if x is y:
            return self._total([x], sides)
        both = ({x, self._without_noise(x, y)}, {y, self._without_noise(y, x)})
        return min(self._across(a, b, sides) for a in both[0] for b in both[1])

    def _without_noise(self, v: Vector, other: Vector) -> Vector:
        """A vector without noise that another one has no part of, also before measurements."""
        value = np.einsum("ij,ij->i", v.at, other.at)
        try:
            plain = self.gram.space.without_noise(v)
        except Full:
            return v
        return plain if self.gram.space.is_pair((plain, other), value, abs(value)) else v

    def _across(self, x: Vector, y: Vector, sides: Sides) -> float:
        """The same of two that are not alike."""
        most = math.sqrt(self._total([x], sides) * self._total([y], sides))
        units = {v.unit.number for v in (x, y) if v.unit is not None}
        rows = [self._over(v, sides, len(units) < 2) for v in (x, y)]
        numbers = {n for row in rows for n in row}
        if len(numbers) < 2 or any(len(c) != 1 for row in rows for c in row.values()):
            return most
        lengths = [self._norm([row], sides) for row in rows]
        across = 0.0
        for n in rows[0].keys() & rows[1].keys():
            ends = rows[0][n][0].times(rows[1][n][0]).ends(sides)
            across += max(-ends[0], ends[1])
        both = 0.5 * (lengths[0] * lengths[1] + across)  # the largest a^T P b of trace one
        return min(most, both * self._numbered(numbers, sides))

    def _over(self, v: Vector, sides: Sides, alike: bool) -> Row:
        """A vector as a sum of others, all less what one measurement takes, if it is ``alike``.

        If u is what it measures, x - (x . u) u and y have the same inner product as both without
        their parts along u.
        """
        if alike and v.unit is not None and not v.unit.share and v.parts[0][0] == ONE:
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
    """Conditions, by number, of whose sides the lengths of vectors or a rest may depend."""
    own = [*rest]
    for v in made_from(vectors):
        own += [*v.noise, *(c for c, _ in v.parts)]
    found = {n for c in own for n, _ in c.sides}
    return found.union(*(conditions_in(node) for c in own for node in c.nodes))


def _parts_of(rows: Sequence[Row]) -> list[list[Row]]:
    """Rows that have vectors in common, directly or by others."""
    parts: list[list[Row]] = []
    for row in rows:
        near = [part for part in parts if any(row.keys() & other.keys() for other in part)]
        parts = [part for part in parts if part not in near]
        parts.append([r for part in near for r in part] + [row])
    return parts


def _matrix(rows: Sequence[Row]) -> list[list[Coefficient | None]] | None:
    """Coefficients by row and vector; None: some are sums, or depend on conditions."""
    numbers = sorted({n for row in rows for n in row})
    each = [c for row in rows for c in row.values()]
    if not each or any(len(c) != 1 or c[0].sides or len(c[0].nodes) > 1 for c in each):
        return None
    return [[row[n][0] if n in row else None for n in numbers] for row in rows]
