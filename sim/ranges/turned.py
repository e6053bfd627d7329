"""Vectors that a matrix with orthogonal rows makes of a vector: a rotation, times a factor.

Rows that are orthogonal for all numbers make A A^T diagonal, so |A v| <= |a| |v| for the longest
row a. A product of quaternions is such a matrix times either of them. So is a rotation of sine and
cosine (s, k) of an angle by a small c, with two terms of each series::

    s' = s - s b - k c    k' = k - k b + s c    b = c^2/2

    s'^2 + k'^2 = (s^2 + k^2) ((1 - b)^2 + c^2) = (s^2 + k^2) (1 + c^4/4)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import Polynomial, plus, polynomial_of, times
from boresight.sim.ranges.unit_vectors import Ball, bare

__all__ = ["Turned", "turned_of"]

#: Terms of a polynomial; steps back to its variables; share that rounding explains.
_TERMS, _DEPTH, _EXACT = 60, 6, 1e-12
#: A row: the factor of each component.
Row = dict[int, Polynomial]


@dataclass(frozen=True, eq=False)
class Turned:
    """The vector A v.

    Attributes
    ----------
    numbers : frozenset of int
        Of the components of A v.
    ball : Ball
        v.
    squares : tuple of Polynomial
        Squared length of each row of A.
    aliases : frozenset of int
        "bounded" nodes that count as their arguments.
    """

    numbers: frozenset[int]
    ball: Ball
    squares: tuple[Polynomial, ...]
    aliases: frozenset[int]


def turned_of(nodes: Mapping[int, Node], balls: Sequence[Ball]) -> Iterator[Turned]:
    """Products A v of vectors v in a step; limited components are another vector."""
    bounded = {n.number for n in nodes.values() if n.kind == "bounded"}
    ends = bounded.union(*(ball.numbers for ball in balls))
    forms: dict[int, tuple[Polynomial, set[int]]] = {}
    for node in nodes.values():
        inner = bare(node)
        if inner.kind == "sum":
            aliases = set[int]()
            form = polynomial_of(inner, _TERMS, _DEPTH, ends - {inner.number}, aliases)
            if form:
                forms[node.number] = form, aliases
    for ball in balls:
        groups: list[dict[int, tuple[Row, Polynomial]]] = []
        for number, (form, _) in forms.items():
            row = _row(form, ball)
            square = None if len(row) < 2 else _product(row, row)
            if square is None:
                continue
            limits = _limits(nodes[number])
            for group in groups:
                if _limits(nodes[min(group)]) == limits and all(
                    _is_zero(_product(row, other)) for other, _ in group.values()
                ):
                    group[number] = row, square
                    break
            else:
                groups.append({number: (row, square)})
        for group in groups:
            if len(group) > 1:
                aliases = set[int]().union(*(forms[n][1] for n in group))
                squares = tuple(square for _, square in group.values())
                yield Turned(frozenset(group), ball, squares, frozenset(aliases))


def _row(form: Polynomial, ball: Ball) -> Row:
    """Factors of a vector's components; empty unless every term has exactly one of them."""
    row: Row = {}
    for m, c in form.items():
        components = [n for n in m if n in ball.numbers]
        if len(components) != 1:
            return {}
        rest = tuple(n for n in m if n != components[0])
        row[components[0]] = plus(row.get(components[0], {}), {rest: c})
    return row


def _product(a: Row, b: Row) -> Polynomial | None:
    """Inner product of two rows; None: of too many terms."""
    out: Polynomial = {}
    for n in a.keys() & b.keys():
        part = times(a[n], b[n], _TERMS)
        if part is None:
            return None
        out = plus(out, part)
    return out


def _is_zero(form: Polynomial | None) -> bool:
    return form is not None and all(abs(c) <= _EXACT for c in form.values())


def _limits(node: Node) -> int:
    """Number of limits around a sum."""
    count = 0
    while node.kind in ("bounded", "saturated"):
        node, count = node.args[0], count + 1
    return count
