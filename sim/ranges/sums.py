"""Sums of vectors: whose inner products the nodes of a step are.

Of F P F^T the vectors are sums, sum_k F_ik p_k; a selection chooses between vectors: its condition
may have either side. |u|^2 - 2 w . t, t = u - w, is |t|^2 + |w|^2: of t with a copy of w in
directions of its own. `noise` and `measurements` have the other ways to make vectors of vectors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from itertools import chain

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import ONE, Coefficient
from boresight.sim.ranges.inner_products import (
    POINTS,
    FloatArray,
    Pair,
    Parts,
    Vector,
    by_vector,
    flat_parts,
    is_scaled,
    made_from,
)
from boresight.sim.ranges.measurements import find_gain, find_measured, find_unit, taken
from boresight.sim.ranges.noise import with_noise
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.points import Points
from boresight.sim.ranges.terms import Term, Terms

__all__ = ["find_vectors"]

#: Vectors that are tried, of those that all terms may be inner products with.
_TRIED = 4


def find_vectors(terms: Terms, node: Node, wanted: Set[int]) -> None:
    """Find the vectors of a node; of a product or a selection, if it is ``wanted``."""
    if node.kind == "rsqrt":
        find_unit(terms.pairs, node)
    elif node.kind == "reciprocal":
        find_measured(terms.pairs, node)
    elif node.kind == "mul" and find_gain(terms.pairs, node):
        pass
    elif node.kind in ("bounded", "saturated"):
        terms.pairs.of(node)
        if node.kind == "bounded" and node.args[0].number in terms.pairs.sums:
            terms.pairs.sums[node.number] = terms.pairs.sums[node.args[0].number]
    elif (
        node.kind == "sum"
        or (node.kind in ("mul", "select", "flip") and node.number in wanted)
        or _is_reset(terms.pairs, node)
    ):
        _take_apart(terms, node)


def _is_reset(pairs: Pairs, node: Node) -> bool:
    """Whether a node is an inner product on one side of a condition, and 0 on the other."""
    values = node.args[1:] if node.kind == "select" else ()
    nothing = [n for n in values if n.kind == "const" and n.value == 0.0]
    return len(nothing) == 1 and any(pairs.of(n) for n in values)


def _take_apart(terms: Terms, node: Node) -> None:
    """Find the vectors of a sum of terms."""
    parts = terms.of(node)
    if parts is None:
        return
    pairs, points = terms.pairs, terms.points
    rest = tuple(t.coefficient for t in parts if not t.factors)
    linear = [t for t in parts if len(t.factors) == 1]
    products = [t for t in parts if len(t.factors) == 2]
    value = sum((_value_of(points, t) for t in linear + products), np.zeros(POINTS))
    size = points.sizes[node.number]
    own = pairs.latest(value, size)
    if [t.coefficient.number < 0.0 for t in linear] == [True]:
        return  # of a vector and its negative there is one
    if not own and linear:
        candidates = chain(_candidates(terms, linear, products), _with_copy(pairs, linear))
        own = [pair for pair in candidates if pairs.space.is_pair(pair, value, size)]
    if not own:
        return
    pairs.sums[node.number] = own, rest
    found = pairs.found.setdefault(node.number, [])
    if not rest:
        found += own
        return
    alike = (v for pair in own for v in _alike(pairs, pair))
    v = next((v for v in alike if pairs.space.is_pair((v, v), value, size)), None)
    noisy = None if v is None else with_noise(pairs, v, rest)
    found += [(noisy, noisy)] if noisy else []


def _value_of(points: Points, term: Term) -> FloatArray:
    """Value of a term at the points: the rest is not subtracted, which may be far larger."""
    return math.prod(
        (points.values[f.number] for f in term.factors), start=points.at(term.coefficient)
    )


def _alike(pairs: Pairs, pair: Pair) -> Iterator[Vector]:
    """Vectors whose square an inner product may be: one of two, or less of it.

    The other may have no part along some unit vectors: what the first one has does not count.
    """
    units = {v.unit.number: v.unit for v in made_from(pair) if v.unit is not None}
    yield from dict.fromkeys(pair)
    for v in dict.fromkeys(pair):
        chosen = [c for c, _ in v.parts if is_scaled(v) and c.is_choice]
        inner = v.parts[0][1] if chosen else v
        for number in sorted(units):
            inner = pairs.space.less(inner, units[number])
            yield pairs.sum_of(((chosen[0], inner),)) if chosen else inner


def _candidates(terms: Terms, linear: Sequence[Term], products: Sequence[Term]) -> Iterator[Pair]:
    """Pairs that a sum may be the inner product of."""
    units = taken(terms, products)
    if units is None:
        return
    pairs = terms.pairs
    for x, y in _common(pairs, linear):
        for chosen, unit in units:
            unit = pairs.sum_of(((chosen, unit),)) if chosen.sides else unit
            x, y = pairs.space.less(x, unit), pairs.space.less(y, unit)
        yield x, y


def _common(pairs: Pairs, linear: Sequence[Term]) -> Iterator[Pair]:
    """A vector that all terms are inner products with, and the sum of the others."""
    first, root = linear[0], linear[0].coefficient.root
    if len(linear) == 1 and root is not None and root.nodes:
        for x, y in pairs.of(first.factors[0]):
            yield pairs.sum_of(((root, x),)), pairs.sum_of(((root, y),))
        return
    found = (pair for t in linear for pair in pairs.of(t.factors[0]))
    tried = 0
    for vector in dict.fromkeys(v for pair in found for v in pair):
        parts = _along(pairs, linear, vector)
        if parts is None:
            continue
        if len(parts) == 1 and parts[0][0].is_choice and parts[0][0].sides:
            yield pairs.sum_of(parts), pairs.sum_of(((parts[0][0], vector),))
        plain = [c for c, _ in parts] == [ONE]
        yield parts[0][1] if plain else pairs.sum_of(parts), vector
        tried += 1
        if tried >= _TRIED:
            return


def _along(pairs: Pairs, linear: Sequence[Term], vector: Vector) -> Parts | None:
    """Of terms that are inner products with a vector, the others; None: some term is none."""
    parts: list[tuple[Coefficient, Vector]] = []
    for t in linear:
        others = _beside(pairs.of(t.factors[0]), vector)
        if not others:
            return None
        parts.append((t.coefficient, max(others, key=lambda v: v.number)))
    return parts


def _beside(found: Sequence[Pair], vector: Vector) -> list[Vector]:
    """The others of those pairs that have a vector, or one that it is on some sides, but noise."""
    while True:
        others = [y if x is vector else x for x, y in found if vector in (x, y)]
        whole = len(vector.parts) != 1 or vector.unit is not None
        if others or whole or not vector.parts[0][0].is_choice:
            return others
        vector = vector.parts[0][1]


def _with_copy(pairs: Pairs, linear: Sequence[Term]) -> Iterator[Pair]:
    """t and a copy of w apart from it, of |u|^2 - 2 w . t with t = u - w."""
    half = Coefficient(-0.5)
    for first in linear:
        rest = [Term(half.times(t.coefficient), t.factors) for t in linear if t is not first]
        chosen = pairs.points.at(first.coefficient)[:, None]
        for u in pairs.roots_of(first.factors[0]) if rest else ():
            for t in (v for pair in pairs.of(rest[0].factors[0]) for v in pair):
                parts = _along(pairs, rest, t) if u in by_vector(flat_parts(t.parts)) else None
                if parts is None:
                    continue
                w = pairs.sum_of(parts)
                if pairs.space.find(chosen * u.at - w.at) is t:
                    both = pairs.sum_of(((ONE, t), (ONE, pairs.space.copy(w))))
                    yield both, both
