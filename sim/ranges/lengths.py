"""Largest lengths of vectors, and the nodes from whose intervals they follow.

They follow from the variances of the states, from conditions on them, and from the intervals of F,
h, q and v; of a row that is one of several kinds, from those of each kind (`cases`). An inner
product is at most the product of the lengths.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from boresight.model.lowering.graph import LEAVES, Node
from boresight.sim.ranges.claims import live
from boresight.sim.ranges.coefficients import (
    CONDITIONS,
    Coefficient,
    Sides,
    all_sides,
    conditions_in,
    ends_of_sum,
    nodes_behind,
    sources_of,
)
from boresight.sim.ranges.inner_products import (
    Pair,
    Vector,
    by_vector,
    flat_parts,
    is_scaled,
    made_from,
)
from boresight.sim.ranges.intervals import Ends
from boresight.sim.ranges.noise import minimum_of
from boresight.sim.ranges.polynomials import Polynomial, plus, quotient, scaled
from boresight.sim.ranges.steps import implied, is_possible
from boresight.sim.ranges.terms import Terms
from boresight.sim.ranges.unit_vectors import Ball
from boresight.sim.ranges.vectors import Vectors

__all__ = ["Lengths"]

#: Terms and steps back of a polynomial.
_TERMS, _BACK = 40, 8


class Lengths:
    """Largest lengths.

    Parameters
    ----------
    terms : Terms
        The limits by conditions.
    vectors : Vectors
        Of the step: lengths of rows of coefficients.
    cases : mapping of int to Ends
        Of nodes in each case.
    largest : dict of int to float
        Largest value of each variance, by the number of its state; beyond its declared range, if
        an update leads there and not beyond its format.
    """

    def __init__(
        self, terms: Terms, vectors: Vectors, cases: Mapping[int, Ends], largest: dict[int, float]
    ) -> None:
        self.nodes, self.terms, self.vectors, self.cases = vectors.nodes, terms, vectors, cases
        self._varying = {
            n
            for n, (low, high) in cases.items()
            if low.max() > self.nodes[n].low or high.min() < self.nodes[n].high
        }
        self._deciding: dict[Vector, frozenset[int]] = {}  # conditions whose sides are tried
        self._rows: dict[tuple[int, ...], tuple[float, Ball]] = {}  # of coefficients
        self.let(largest)

    def let(self, largest: dict[int, float]) -> None:
        """Set the largest variances, and forget all lengths."""
        self.largest = largest
        self._lengths: dict[Vector, float] = {}
        self._row_balls: dict[Vector, Ball] = {}  # rows that decide lengths
        self._case_base: dict[Vector, set[Node]] = {}  # premises of lengths in cases
        self._balance_base: dict[Vector, set[Node]] = {}  # premises of lengths with noise
        self._by_ends: set[Vector] = set()  # whose lengths follow from others' and intervals

    def ends(self, pair: Pair, rest: Sequence[Coefficient] = ()) -> tuple[float, float]:
        """Ends of an inner product and a rest, over the sides of the conditions."""
        x, y = pair
        bound = self.longest(x) * self.longest(y)
        low, high = (0.0 if x is y or _is_multiple(x, y) else -bound), bound
        if rest:
            conditions = {n for c in rest for n, _ in c.sides}
            ends = [ends_of_sum(rest, sides) for sides in all_sides(conditions)]
            low, high = low + min(a for a, _ in ends), high + max(b for _, b in ends)
        return low, high

    def longest(self, v: Vector) -> float:
        """Largest length of a vector, over the sides of its conditions."""
        if v not in self._lengths:
            self._lengths[v] = math.inf  # during the computation, which may need it on some sides
            self._lengths[v] = max(
                self._length(v, sides, self._caps(sides), {})
                for sides in all_sides(self._conditions_of(v))
                if is_possible(self.nodes, sides)
            )
        return self._lengths[v]

    def _conditions_of(self, v: Vector) -> frozenset[int]:
        """Conditions of the vector's parts and, if these are few, of its coefficients.

        Those of most coefficients first; those of a single one only where P decides it.
        """
        if v not in self._deciding:
            cone, count = self.terms.points.cone, Counter[int]()
            for c in (*(c for c, _ in flat_parts(v.parts)), *v.noise):
                count.update({n for node in c.nodes for n in conditions_in(node)} - v.conditions)
            extra = [n for n in count if n in cone or count[n] > 1]
            extra.sort(key=lambda n: (-count[n], n))
            remaining = max(0, CONDITIONS - len(v.conditions))
            self._deciding[v] = v.conditions.union(extra[:remaining])
        return self._deciding[v]

    def _caps(self, sides: Sides) -> dict[int, float]:
        """Largest lengths that conditions allow, by vector."""
        caps: dict[int, float] = {}
        for squares, total in self.terms.limits_on(sides):
            for number, factor in squares.items():
                length = math.sqrt(max(0.0, total / factor))
                caps[number] = min(caps.get(number, math.inf), length)
        return caps

    # -- premises of lengths ----------------------------------------------------------------------

    def base_of(self, pair: Pair, *, by_case: bool = True) -> set[Node]:
        """The nodes whose intervals the lengths of vectors follow from.

        ``by_case``: where a length follows from those of each case, these alone.
        """
        base: set[Node] = set()
        for v in self._vectors_behind(pair) if by_case else made_from(pair):
            if v.variance is not None and self.largest[v.variance.number] <= v.variance.high:
                base.add(v.variance)
            if not (by_case and self._is_by_case(v)):
                base |= nodes_behind(c for c, _ in v.parts)
            base |= nodes_behind(v.noise) | self._case_base.get(v, set())
            for node in self._balance_base.get(v, ()):
                base |= {node, *sources_of(node)}
        return base | {self.nodes[n] for ball in self.rows_of(pair) for n in ball.used}

    def rows_of(self, pair: Pair) -> list[Ball]:
        """The rows of coefficients whose lengths the lengths of vectors follow from."""
        return [
            self._row_balls[v]
            for v in self._vectors_behind(pair)
            if v in self._row_balls and not self._is_by_case(v)
        ]

    def _is_by_case(self, v: Vector) -> bool:
        """Whether the length of a vector follows from those of each case alone."""
        return v in self._case_base and v not in self._by_ends

    def _vectors_behind(self, pair: Pair) -> Iterator[Vector]:
        """Vectors from whose lengths those of two follow."""
        return made_from(pair, lambda v: flat_parts(v.parts) if self._is_by_case(v) else v.parts)

    # -- lengths ----------------------------------------------------------------------------------

    def _length(
        self, v: Vector, sides: Sides, caps: Mapping[int, float], lengths: dict[Vector, float]
    ) -> float:
        """Largest length of a vector on the given sides, where conditions cap some.

        ``lengths``: of other vectors on these.
        """
        if v not in lengths:
            length = partial(self._length, sides=sides, caps=caps, lengths=lengths)
            lengths[v] = min(self._from_parts(v, sides, length), caps.get(v.number, math.inf))
            if not self._conditions_of(v) <= sides.keys():
                lengths[v] = min(lengths[v], self.longest(v))
        return lengths[v]

    def _from_parts(self, v: Vector, sides: Sides, length: Callable[[Vector], float]) -> float:
        """The same by the parts of the vector, each of the largest ``length``."""
        if v.variance is not None:
            return math.sqrt(max(self.largest[v.variance.number], 0.0))
        if v.measured is not None:
            return 1.0
        bound = 0.0
        for part, coefficients in by_vector(v.parts).items():
            low, high = ends_of_sum(coefficients, sides)
            size = max(-low, high)
            bound += size * length(part) if size else 0.0
        bound = min(bound, self._of_row(v, bound, length), self._of_weight(v, sides))
        bound = min(bound, self._in_cases(v, bound, sides, length))
        if v.noise:
            square = bound * bound + v.largest_noise(sides)
            bound = math.sqrt(self._balanced(v, square, sides, length))
        if v.unit is not None and (m := _measured(v.unit, sides)) is not None:
            vector, noise = m
            if any(part is vector for _, part in v.parts) and bound > 0.0:
                bound = math.sqrt(bound * bound * noise / (bound * bound + noise))
        return bound

    def _of_row(self, v: Vector, bound: float, length: Callable[[Vector], float]) -> float:
        """|sum of r_k p_k| <= |r| sqrt(sum of |p_k|^2),  where that is less than ``bound``."""
        parts = [*flat_parts(v.parts)]
        if len(parts) < 2 or any(len(c.nodes) != 1 or c.sides for c, _ in parts):
            return math.inf
        row = [c.nodes[0] for c, _ in parts]
        key = tuple(n.number for n in row)
        if len({*key}) < len(key):
            return math.inf
        if key not in self._rows:
            self._rows[key] = self.vectors.square_of(row)
        square, ball = self._rows[key]
        row_bound = math.sqrt(square * sum((c.number * length(p)) ** 2 for c, p in parts))
        if row_bound < bound:
            self._row_balls[v] = ball
        return row_bound

    def _of_weight(self, v: Vector, sides: Sides) -> float:
        """|k m| <= sqrt(w / 4 v) of k = w / (w |m|^2 + v)."""
        weight = self.terms.pairs.weights.get(v.parts[0]) if is_scaled(v) else None
        if weight is None:
            return math.inf
        lower = minimum_of(weight.noise)
        return math.sqrt(weight.factor.ends(sides)[1] / (4.0 * lower)) if lower > 0.0 else math.inf

    def _balanced(
        self, v: Vector, square: float, sides: Sides, length: Callable[[Vector], float]
    ) -> float:
        """Largest |c p|^2 plus noise; ``square``: the sum of the largest of each.

        Where there is more noise, c may be less. If the terms of a nonnegative node in the sum are
        not positive, they are left out: the sum is largest where that node is 0.
        """
        inner = v.parts[0][1]
        while inner.unit is not None:
            inner = inner.parts[0][1]
        if not is_scaled(inner) or not inner.parts[0][0].nodes or inner.conditions:
            return square
        if any(c.sides for c in v.noise):
            return square
        ((c, p),) = inner.parts
        bounded = self.terms.points.bounded
        forms = [k.polynomial(_TERMS, _BACK, bounded) for k in (c.times(c), *v.noise)]
        total: Polynomial = {}
        for form, factor in zip(forms, (length(p) ** 2, *(1.0 for _ in v.noise)), strict=True):
            if form is None:
                return square
            total = plus(total, scaled(form, factor))
        for n in sorted({n for m in total for n in m}):
            if self.nodes[n].low >= 0.0 and self._upper_of(quotient(total, n), sides) <= 0.0:
                total = {m: value for m, value in total.items() if n not in m}
        upper = self._upper_of(total, sides)
        if upper < square:
            numbers = {n for form in forms for m in form or () for n in m}
            self._balance_base[v] = {self.nodes[n] for n in numbers}
        return min(upper, square)

    def _upper_of(self, form: Polynomial, sides: Sides) -> float:
        """Largest value of a polynomial."""
        terms = (Coefficient(c, tuple(self.nodes[n] for n in m)) for m, c in form.items())
        return ends_of_sum(terms, sides)[1]

    def _in_cases(
        self, v: Vector, bound: float, sides: Sides, length: Callable[[Vector], float]
    ) -> float:
        """The largest of the lengths in each case, where that is less than ``bound``."""
        parts = [*flat_parts(v.parts)]
        if len(parts) < 2 or not any(n.number in self._varying for c, _ in parts for n in c.nodes):
            self._by_ends.add(v)
            return math.inf
        total, fixed = np.zeros(1), dict(implied(self.nodes, sides))
        for part, coefficients in by_vector(parts).items():
            ends = [c.ends_in(self.cases, fixed) for c in coefficients]
            low, high = (sum(e) for e in zip(*ends, strict=True))
            total = total + np.maximum(-low, high) * length(part)
        for number, side in fixed.items():  # not in cases in which a condition has the other side
            low, high = self.cases[number]
            total = np.where(low >= 0.0 if side == 1 else high < 0.0, 0.0, total)
        largest = float(total.max())
        if largest >= bound:
            self._by_ends.add(v)
        elif v not in self._case_base:
            conditions = (self.nodes[number] for number in fixed)
            predecessors = live([*conditions, *(n for c, _ in parts for n in c.nodes)])
            self._case_base[v] = {n for n in predecessors if n.kind in LEAVES}
        return largest


def _is_multiple(x: Vector, y: Vector) -> bool:
    """Whether one vector is another one times a nonnegative coefficient."""
    return any(
        is_scaled(a) and a.parts[0][1] is b and a.parts[0][0].ends({})[0] >= 0.0
        for a, b in ((x, y), (y, x))
    )


def _measured(unit: Vector, sides: Sides) -> tuple[Vector, float] | None:
    """The vector that a unit vector measures, and the largest noise; None: no measurement."""
    if len(unit.parts) == 1 and unit.measured is None:  # where it is chosen
        c, unit = unit.parts[0]
        if any(sides.get(n) != s for n, s in c.sides):
            return None
    total = unit.measured
    if total is None or not total.noise:
        return None
    return total.parts[0][1], total.largest_noise(sides)
