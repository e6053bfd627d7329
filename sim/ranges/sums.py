"""Sums of vectors, of which the nodes of a step are inner products.

The vectors of F P F^T are sums, sum_k F_ik p_k; a selection chooses between vectors: its condition
may have either side. |u|^2 - 2 w . t, t = u - w, is |t|^2 + |w|^2: the square of t plus a copy of w
in directions of its own. `noise` and `measurements` construct vectors in other ways.
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
from boresight.sim.ranges.measurements import directions, find_gain, find_measured, find_unit
from boresight.sim.ranges.noise import with_noise
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.points import Points
from boresight.sim.ranges.terms import Term, Terms

__all__ = ["find_vectors"]

#: Most vectors that are tried as the common one of all terms.
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
        _find_of_sum(terms, node)


def _is_reset(pairs: Pairs, node: Node) -> bool:
    """Whether a node is an inner product on one side of a condition, and 0 on the other."""
    values = node.args[1:] if node.kind == "select" else ()
    zeros = [n for n in values if n.kind == "const" and n.value == 0.0]
    return len(zeros) == 1 and any(pairs.of(n) for n in values)


def _find_of_sum(terms: Terms, node: Node) -> None:
    """Find the vectors of a node that is a sum of terms."""
    parts = terms.of(node)
    if parts is None:
        return
    pairs, points = terms.pairs, terms.points
    rest = tuple(t.coefficient for t in parts if not t.factors)
    linear = [t for t in parts if len(t.factors) == 1]
    products = [t for t in parts if len(t.factors) == 2]
    value = sum((_value_of(points, t) for t in linear + products), np.zeros(POINTS))
    size = points.sizes[node.number]
    matches = pairs.latest(value, size)
    if [t.coefficient.number < 0.0 for t in linear] == [True]:
        return  # a vector and its negative count as one
    if not matches and linear:
        candidates = chain(_candidates(terms, linear, products), _with_copy(pairs, linear))
        matches = [pair for pair in candidates if pairs.space.is_pair(pair, value, size)]
    if not matches:
        return
    pairs.sums[node.number] = matches, rest
    node_pairs = pairs.by_node.setdefault(node.number, [])
    if not rest:
        node_pairs += matches
        return
    roots = (v for pair in matches for v in _root_candidates(pairs, pair))
    v = next((v for v in roots if pairs.space.is_pair((v, v), value, size)), None)
    noisy = None if v is None else with_noise(pairs, v, rest)
    node_pairs += [(noisy, noisy)] if noisy else []


def _value_of(points: Points, term: Term) -> FloatArray:
    """Value of a term at the points: the rest is not subtracted, which may be far larger."""
    return math.prod(
        (points.values[f.number] for f in term.factors), start=points.at(term.coefficient)
    )


def _root_candidates(pairs: Pairs, pair: Pair) -> Iterator[Vector]:
    """Vectors whose square an inner product may be: one of the pair, or a part of it.

    The other one may have no part along some unit vectors: then that of the first does not count.
    """
    units = {v.unit.number: v.unit for v in made_from(pair) if v.unit is not None}
    yield from dict.fromkeys(pair)
    for v in dict.fromkeys(pair):
        choices = [c for c, _ in v.parts if is_scaled(v) and c.is_choice]
        inner = v.parts[0][1] if choices else v
        for number in sorted(units):
            inner = pairs.space.remainder(inner, units[number])
            yield pairs.sum_of(((choices[0], inner),)) if choices else inner


def _candidates(terms: Terms, linear: Sequence[Term], products: Sequence[Term]) -> Iterator[Pair]:
    """Pairs that a sum may be the inner product of."""
    units = directions(terms, products)
    if units is None:
        return
    pairs = terms.pairs
    for x, y in _common_vector(pairs, linear):
        for choice, unit in units:
            unit = pairs.sum_of(((choice, unit),)) if choice.sides else unit
            x, y = pairs.space.remainder(x, unit), pairs.space.remainder(y, unit)
        yield x, y


def _common_vector(pairs: Pairs, linear: Sequence[Term]) -> Iterator[Pair]:
    """A common vector of all terms, and the sum of their other vectors."""
    first, root = linear[0], linear[0].coefficient.root
    if len(linear) == 1 and root is not None and root.nodes:
        for x, y in pairs.of(first.factors[0]):
            yield pairs.sum_of(((root, x),)), pairs.sum_of(((root, y),))
        return
    factor_pairs = (pair for t in linear for pair in pairs.of(t.factors[0]))
    count = 0
    for vector in dict.fromkeys(v for pair in factor_pairs for v in pair):
        parts = _cofactors(pairs, linear, vector)
        if parts is None:
            continue
        if len(parts) == 1 and parts[0][0].is_choice and parts[0][0].sides:
            yield pairs.sum_of(parts), pairs.sum_of(((parts[0][0], vector),))
        is_plain = [c for c, _ in parts] == [ONE]
        yield parts[0][1] if is_plain else pairs.sum_of(parts), vector
        count += 1
        if count >= _TRIED:
            return


def _cofactors(pairs: Pairs, linear: Sequence[Term], vector: Vector) -> Parts | None:
    """The other vectors of inner products with a vector; None: a term is no such product."""
    parts: list[tuple[Coefficient, Vector]] = []
    for t in linear:
        others = _partners(pairs.of(t.factors[0]), vector)
        if not others:
            return None
        parts.append((t.coefficient, max(others, key=lambda v: v.number)))
    return parts


def _partners(candidates: Sequence[Pair], vector: Vector) -> list[Vector]:
    """The other vectors of pairs with a vector, or the one it is on some sides but for noise."""
    while True:
        others = [y if x is vector else x for x, y in candidates if vector in (x, y)]
        is_atomic = len(vector.parts) != 1 or vector.unit is not None
        if others or is_atomic or not vector.parts[0][0].is_choice:
            return others
        vector = vector.parts[0][1]


def _with_copy(pairs: Pairs, linear: Sequence[Term]) -> Iterator[Pair]:
    """t plus a copy of w, for |u|^2 - 2 w . t with t = u - w."""
    half = Coefficient(-0.5)
    for first in linear:
        rest = [Term(half.times(t.coefficient), t.factors) for t in linear if t is not first]
        indicator = pairs.points.at(first.coefficient)[:, None]
        for u in pairs.roots_of(first.factors[0]) if rest else ():
            for t in (v for pair in pairs.of(rest[0].factors[0]) for v in pair):
                parts = _cofactors(pairs, rest, t) if u in by_vector(flat_parts(t.parts)) else None
                if parts is None:
                    continue
                w = pairs.sum_of(parts)
                if pairs.space.find(indicator * u.at - w.at) is t:
                    total = pairs.sum_of(((ONE, t), (ONE, pairs.space.copy(w))))
                    yield total, total
