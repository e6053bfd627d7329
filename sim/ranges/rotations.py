"""Rotation matrices of quaternions of length one or less: they lengthen no vector.

With s = |q|^2 <= 1 and C = 1 + 2 w [v x] + 2 [v x]^2 the squared length of C a is |a|^2 along v,
and 1 - 4 |v|^2 (1 - s) times it across v. So C a, or some components of it, is no longer than a,
and so is C^T a.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations, product

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import Polynomial, monomial, polynomial_of
from boresight.sim.ranges.unit_vectors import Ball

__all__ = ["Rotation", "element", "rotations_of"]

#: Terms of an element of a matrix, and steps back to the quaternion; the same of a component.
_ELEMENT, _STEPS = 4, 4
_TERMS, _DEPTH = 100, 24
#: Largest difference of equal coefficients; largest rounding error of a length of one.
_SAME, _ROUNDING = 1e-12, 1e-9


@dataclass(frozen=True, eq=False)
class Rotation:
    """The rotation matrix of a vector that is within the unit ball.

    Attributes
    ----------
    at : mapping of int to (int, int)
        Row and column of nodes, by number.
    ball : Ball
    aliases : frozenset of int
        "bounded" nodes that count as their arguments, its elements among them.
    """

    at: Mapping[int, tuple[int, int]]
    ball: Ball
    aliases: frozenset[int]
    _forms: dict[int, tuple[Polynomial, set[int]]] = field(default_factory=dict, repr=False)

    def turned(self, vector: Sequence[Node], aliases: set[int]) -> list[Polynomial] | None:
        """The vector of which a vector is the rotated one, times the largest of the factors.

        None: there is none. ``aliases`` gets the "bounded" nodes that count as their arguments.
        """
        for axis in (0, 1):
            bounded = set(self.aliases)
            rows = [self._row(node, axis, bounded) for node in vector]
            matched = [row for row in rows if row is not None]
            lines = {line for line, _ in matched}
            if not matched or len(matched) < len(vector) or len(lines) < len(vector):
                continue
            largest = max((parts for _, parts in matched), key=_size)
            if all(_is_multiple(parts, largest) for _, parts in matched):
                aliases |= bounded
                return [*largest.values()]
        return None

    def _row(
        self, node: Node, axis: int, aliases: set[int]
    ) -> tuple[int, dict[int, Polynomial]] | None:
        """Row or column whose elements a component contains, and the factor of each element."""
        if node.number not in self._forms:
            bounded = set[int]()
            form = polynomial_of(node, _TERMS, _DEPTH, self.at, bounded)
            self._forms[node.number] = form or {}, bounded
        form, bounded = self._forms[node.number]
        aliases |= bounded
        parts: dict[int, Polynomial] = {}
        lines = set()
        for m, c in form.items():
            elements = [n for n in m if n in self.at]
            if len(elements) != 1:
                return None
            position = self.at[elements[0]]
            lines.add(position[axis])
            rest = tuple(n for n in m if n not in self.at)
            parts.setdefault(position[1 - axis], {})[rest] = c
        return (lines.pop(), parts) if len(lines) == 1 else None


def rotations_of(nodes: Mapping[int, Node], balls: Sequence[Ball]) -> Iterator[Rotation]:
    """The rotation matrices of which a step computes elements."""
    bounded = [node for node in nodes.values() if node.kind == "bounded"]
    quaternions = (b for b in balls if len(b.numbers) == 4 and b.square <= 1.0 + _ROUNDING)
    for numbers, ball in {ball.numbers: ball for ball in quaternions}.items():
        forms: dict[int, Polynomial] = {}
        aliases: dict[int, set[int]] = {}
        for node in bounded:
            through = {node.number}
            form = polynomial_of(node.args[0], _ELEMENT, _STEPS, numbers, through)
            if form and all(n in numbers for m in form for n in m):
                forms[node.number], aliases[node.number] = form, through
        places = max((_places(forms, order) for order in permutations(sorted(numbers))), key=len)
        if len({*places.values()}) > 1:
            yield Rotation(places, ball, frozenset().union(*(aliases[n] for n in places)))


def _places(forms: Mapping[int, Polynomial], order: Sequence[int]) -> dict[int, tuple[int, int]]:
    """Row and column of forms that are elements of the matrix of a quaternion."""
    w, *v = order
    out: dict[int, tuple[int, int]] = {}
    for i, j in product(range(3), repeat=2):
        wanted = element(w, v, i, j)
        out |= {n: (i, j) for n, form in forms.items() if form == wanted}
    return out


def element(w: int, v: Sequence[int], i: int, j: int, sign: float = 1.0) -> Polynomial:
    """Element of 1 + 2 w [v x] + 2 [v x]^2, with a sign of w."""
    if i == j:
        return {(): 1.0} | {(n, n): -2.0 for n in v if n != v[i]}
    turn = -2.0 if (j - i) % 3 == 1 else 2.0
    return {monomial(v[i], v[j]): 2.0, monomial(w, v[3 - i - j]): sign * turn}


def _size(parts: Mapping[int, Polynomial]) -> float:
    """The largest coefficient."""
    return max(abs(c) for part in parts.values() for c in part.values())


def _is_multiple(parts: Mapping[int, Polynomial], other: Mapping[int, Polynomial]) -> bool:
    """Whether factors are a multiple of those of another row."""
    if parts.keys() != other.keys():
        return False
    ratio = _size(parts) / _size(other)
    return any(
        all(
            part.keys() == other[k].keys()
            and all(abs(c - s * other[k][m]) <= _SAME * _size(other) for m, c in part.items())
            for k, part in parts.items()
        )
        for s in (ratio, -ratio)
    )
