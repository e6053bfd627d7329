"""Polynomials of the squared length of a vector, and vectors computed from them.

The quaternion of a turn is (w, s h) with h half the turn and w and s polynomials of |h|^2, the
series of the cosine and of the sine over the angle. So is its squared length, w^2 + s^2 |h|^2,
whose largest value is that of a polynomial of one variable, or of two where |h|^2 has a limit:
one below it, one above.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.claims import live
from boresight.sim.ranges.polynomials import (
    Polynomial,
    plus,
    polynomial_of,
    scaled,
    substituted,
    times,
)
from boresight.sim.ranges.unit_vectors import Ball

__all__ = ["Radial", "radial", "radial_balls"]

#: Terms of a polynomial, steps back, components of a vector; largest rounding error.
_TERMS, _DEPTH, _COMPONENTS, _TINY = 400, 24, 4, 1e-12


class Radial:
    """A polynomial of the squared length of a vector.

    Attributes
    ----------
    numbers : list of int
        Of the components.
    """

    def __init__(self, numbers: list[int], coefficients: list[float]) -> None:
        self.numbers = numbers
        self._series = np.polynomial.Polynomial(coefficients)

    def ends(self, upper: float, lower: float = 0.0) -> tuple[float, float]:
        """Least and largest value where the squared length lies between two."""
        roots = np.real(self._series.deriv().roots())  # complex ones add harmless points
        values = self._series(np.clip([lower, upper, *roots], lower, upper))
        return float(np.min(values)), float(np.max(values))


def radial(form: Polynomial) -> Radial | None:
    """A polynomial of 2 to 4 nodes as one of the sum of their squares; None: of another form."""
    numbers = sorted({n for m in form for n in m})
    if not 2 <= len(numbers) <= _COMPONENTS or any(len(m) % 2 for m in form):
        return None
    by_power = {len(m) // 2: c for m, c in form.items() if {*m} <= {numbers[0]}}
    total: Polynomial = {(n, n): 1.0 for n in numbers}
    power: Polynomial | None = {(): 1.0}
    rest = form
    for k in range(max(by_power, default=0) + 1):
        rest = plus(rest, scaled(power or {}, -by_power.get(k, 0.0)))
        power = times(power or {}, total, _TERMS)
    if any(abs(c) > _TINY for c in rest.values()):
        return None
    coefficients = [by_power.get(k, 0.0) for k in range(max(by_power, default=0) + 1)]
    return Radial(numbers, [c if abs(c) > _TINY else 0.0 for c in coefficients])


def radial_balls(nodes: Mapping[int, Node]) -> Iterator[Ball]:
    """Vectors (w, s h) with polynomials w and s of |h|^2; for each s the w of least length.

    Without any w from which s is computed, such as |h|^2. Also (s, s h) if it is no longer than one
    and s is one where h is 0: a correction (1, h) divided by its length or more.
    """
    sources = _sources(nodes)
    bounded = [n for n in nodes.values() if n.kind == "bounded"]
    for factor, products in _products(nodes).items():
        h = sources.get(factor, frozenset())
        if len(h) < 2 or not h <= products.keys():
            continue
        upper = sum(max(nodes[n].low ** 2, nodes[n].high ** 2) for n in h)
        sine = [products[n] for n in sorted(h)]
        inner = {n.number for n in live(sine)}
        balls = [
            ball
            for w in bounded
            if sources.get(w.number) == h
            and w.number not in inner
            and (ball := _ball(nodes, [w, *sine], h, upper)) is not None
        ]
        if balls:
            yield min(balls, key=lambda ball: ball.square)
        form = polynomial_of(nodes[factor], _TERMS, _DEPTH, h) or {}
        if form.get(()) == 1.0:
            ball = _ball(nodes, [nodes[factor], *sine], h, upper)
            if ball is not None and ball.square <= 1.0:
                yield ball


def _ball(
    nodes: Mapping[int, Node], vector: Sequence[Node], h: frozenset[int], upper: float
) -> Ball | None:
    """A vector whose squared length is a polynomial of |h|^2, which is at most ``upper``."""
    aliases = set[int]()
    total: Polynomial = {}
    for node in vector:
        form = polynomial_of(node, _TERMS, _DEPTH, h, aliases)
        square = None if form is None else times(form, form, _TERMS)
        if square is None:
            return None
        total = plus(total, square)
    largest = 0.0
    pieces = [*_pieces(nodes, total, h, upper, aliases)]
    for form, low, high in pieces:
        polynomial = radial({m: c for m, c in form.items() if abs(c) > _TINY})
        if polynomial is None or {*polynomial.numbers} != h:
            return None
        largest = max(largest, polynomial.ends(high, low)[1])
    numbers = frozenset(node.number for node in vector)
    return Ball(numbers, h, frozenset(aliases), largest) if pieces else None


def _pieces(
    nodes: Mapping[int, Node], form: Polynomial, h: frozenset[int], upper: float, aliases: set[int]
) -> Iterator[tuple[Polynomial, float, float]]:
    """A polynomial below and above a limit of |h|^2, each with the ends of |h|^2 there."""
    limited = {n for m in form for n in m if n not in h}
    if not limited:
        yield form, 0.0, upper
    if len(limited) == 1:
        (number,) = limited
        node = nodes[number]
        if node.kind == "saturated":
            length = polynomial_of(node.args[0], _TERMS, _DEPTH, h, aliases)
            if length == {(n, n): 1.0 for n in h}:
                limit = min(node.value, upper)
                below = substituted(form, number, length, _TERMS)
                above = substituted(form, number, {(): node.value}, _TERMS)
                if below is not None and above is not None:
                    yield below, 0.0, limit
                    yield above, limit, upper


def _sources(nodes: Mapping[int, Node]) -> dict[int, frozenset[int]]:
    """Variables of each node that is a polynomial; absent if they are too many."""
    out: dict[int, frozenset[int]] = {}
    for number, node in nodes.items():
        if node.kind not in ("bounded", "sum", "mul") and not _is_limited_length(node, out):
            out[number] = frozenset({number} if node.kind != "const" else ())
        elif all(a.number in out for a in node.args):
            union = frozenset[int]().union(*(out[a.number] for a in node.args))
            if len(union) <= _COMPONENTS:
                out[number] = union
    return out


def _is_limited_length(node: Node, sources: Mapping[int, frozenset[int]]) -> bool:
    """Whether a node is a sum of several others, none of them negative, with a limit."""
    if node.kind != "saturated" or node.args[0].low < 0.0:
        return False
    return len(sources.get(node.args[0].number, ())) > 1


def _products(nodes: Mapping[int, Node]) -> dict[int, dict[int, Node]]:
    """Products of each factor, by the other factor; each with the claims on it."""
    out: dict[int, dict[int, Node]] = {}
    for node in nodes.values():
        inner = node
        while inner.kind == "bounded":
            inner = inner.args[0]
        if inner.kind == "mul":
            for factor, other in (inner.args, inner.args[::-1]):
                out.setdefault(factor.number, {})[other.number] = node
    return out
