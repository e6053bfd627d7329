"""Largest norms of vectors and matrices that are computed from quaternions.

A correction is k, q' = (q k) r with r = 1 / sqrt(min(|q k|^2, limit)), and a covariance is turned
by c = k r or k r^2. With |q k|^2 = |q|^2 |k|^2 and |q| >= 1,

    |k r|^2 <= max(1, |k|^2 / limit)        |k r^2|^2 <= max(1 / |k|^2, |k|^2 / limit^2)

The length of q has a lower bound because that of (q k) r is one or more, because limits of the
components leave one of them at its limit, and because |a b|^2 = |a|^2 |b|^2. As in
`sim.ranges.vectors`, constants that are one but for rounding count as one.

The matrix of a quaternion c, or a part of it, M, has the norm |c| at most: |c|^2 1 - M^T M is a
square, v v^T. A rotation matrix C = 1 + 2 w [v x] + 2 [v x]^2 of a quaternion (w, v) that is not of
length one has C^T C = 1 + 4 (w^2 + |v|^2 - 1) (|v|^2 1 - v v^T); some of its
rows have no larger norm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import permutations, product

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.coefficients import Coefficient
from boresight.sim.ranges.polynomials import (
    Polynomial,
    is_sum_of_squares,
    is_zero,
    plus,
    polynomial_of,
    quotient,
    scaled,
    times,
)
from boresight.sim.ranges.radial import radial
from boresight.sim.ranges.rotations import element
from boresight.sim.ranges.unit_vectors import Ball, bare
from boresight.sim.ranges.vectors import Vectors

__all__ = ["Norms"]

#: Terms of a polynomial, and steps back; largest rounding error of constants.
_TERMS, _DEPTH, _ROUNDING = 400, 24, 1e-8
_TINY = 1e-12


class Norms:
    """The norms of a compiled step.

    Parameters
    ----------
    vectors : Vectors
        Of the same step.
    """

    def __init__(self, vectors: Vectors) -> None:
        self.nodes, self.vectors = vectors.nodes, vectors
        self.after, self.first = vectors.after, vectors.first
        self.squares: dict[tuple[int, ...], tuple[float, Ball]] = {}
        self.rotations: dict[tuple[tuple[float, int], ...], tuple[int, ...] | None] = {}
        self.long: dict[frozenset[int], Ball | None] = {}  # states no shorter than one
        self.used: set[int] = set()
        self.aliases: set[int] = set()

    def square_of(
        self, matrix: Sequence[Sequence[Coefficient | None]]
    ) -> tuple[float, Ball | None]:
        """Upper bound of the squared norm of a matrix, None for 0, with its premises."""
        rows = [[None if c is None else _signed(c) for c in row] for row in matrix]
        if len(rows[0]) == 1:
            rows = [[c for (c,) in rows]]
        if len(rows) == 1:
            return self._length([c for c in rows[0] if c is not None])
        if len(rows) == len(rows[0]):
            bound = self._of_quaternion(rows)
            if bound[1] is not None:
                return bound
        return self._of_rotation(rows)

    def _length(self, row: Sequence[Coefficient]) -> tuple[float, Ball | None]:
        """Squared length of a row."""
        nodes = [c.nodes[0] for c in row if c.nodes]
        if len({n.number for n in nodes}) < len(nodes):
            return math.inf, None
        if not nodes:
            return sum(c.number**2 for c in row), None
        square, ball = self._square(nodes)
        largest = max((c.number * c.number for c in row if c.nodes), default=0.0)
        return largest * square + sum(c.number**2 for c in row if not c.nodes), ball

    def _square(self, vector: Sequence[Node]) -> tuple[float, Ball]:
        """Squared length of a vector of nodes."""
        key = tuple(sorted(n.number for n in vector))
        if key not in self.squares:
            square, ball = self.vectors.square_of(vector)
            square = _exact(square)
            self.used, self.aliases = set(), set()
            correction = self._of_correction(vector)
            if correction < square:
                square, ball = (
                    correction,
                    Ball(frozenset(key), frozenset(self.used), frozenset(self.aliases)),
                )
            self.squares[key] = square, ball
        within = [entry for numbers, entry in self.squares.items() if {*key} <= {*numbers}]
        return min(within, key=lambda entry: entry[0])

    # -- matrices ---------------------------------------------------------------------------------

    def _of_quaternion(
        self, rows: Sequence[Sequence[Coefficient | None]]
    ) -> tuple[float, Ball | None]:
        """Squared norm of the matrix of a quaternion, or of a part of it."""
        entries = [c for row in rows for c in row if c is not None]
        if any(len(c.nodes) != 1 or abs(c.number) != 1.0 for c in entries):
            return math.inf, None
        numbers = sorted({c.nodes[0].number for c in entries})
        if len(numbers) > 4:
            return math.inf, None
        size = range(len(rows))
        forms: list[list[Polynomial]] = [
            [{} if c is None else {(c.nodes[0].number,): c.number} for c in row] for row in rows
        ]
        total: Polynomial = {(n, n): 1.0 for n in numbers}
        residual = [[_rest(forms, i, j, total) for j in size] for i in size]
        diagonal: Polynomial = {}
        for i in size:
            diagonal = plus(diagonal, residual[i][i])
        if not is_sum_of_squares(diagonal):
            return math.inf, None
        for i, j, k, m in product(size, repeat=4):
            if i < j and k < m:
                minor = plus(
                    times(residual[i][k], residual[j][m], _TERMS) or {},
                    scaled(times(residual[i][m], residual[j][k], _TERMS) or {}, -1.0),
                )
                if not is_zero(minor):
                    return math.inf, None
        return self._square([self.nodes[n] for n in numbers])

    def _of_rotation(
        self, rows: Sequence[Sequence[Coefficient | None]]
    ) -> tuple[float, Ball | None]:
        """Squared norm of a rotation matrix of a quaternion, transposed or not, or of its rows."""
        entries = [c for row in rows for c in row]
        if (
            len(rows[0]) != 3
            or len(rows) > 3
            or any(c is None or len(c.nodes) != 1 for c in entries)
        ):
            return math.inf, None
        key = tuple((c.number, c.nodes[0].number) for c in entries if c is not None)
        if key not in self.rotations:
            self.rotations[key] = self._quaternion_of(rows)
        quaternion = self.rotations[key]
        if quaternion is None:
            return math.inf, None
        w, *v = quaternion
        aliases: set[int] = set()
        for c in entries:
            if c is not None:
                bare(c.nodes[0], aliases)
        q_square, ball = self._square([self.nodes[n] for n in (w, *v)])
        v_square, v_ball = self._square([self.nodes[n] for n in v])
        square = max(1.0, 1.0 + 4.0 * (q_square - 1.0) * min(v_square, q_square))
        used = ball.used | v_ball.used
        return square, Ball(frozenset(), used, ball.aliases | v_ball.aliases | aliases)

    def _quaternion_of(
        self, rows: Sequence[Sequence[Coefficient | None]]
    ) -> tuple[int, ...] | None:
        """The quaternion whose rotation matrix has these rows; None: it is another matrix."""
        bounded = self.vectors.bounded
        forms = [
            [
                scaled(polynomial_of(bare(c.nodes[0]), _TERMS, _DEPTH, bounded) or {}, c.number)
                for c in row
                if c is not None
            ]
            for row in rows
        ]
        numbers = {n for row in forms for form in row for m in form for n in m}
        if len(numbers) != 4:
            return None
        for w, *v in permutations(sorted(numbers)):
            for sign, indices in product((1.0, -1.0), permutations(range(3), len(rows))):
                if _is_rotation(forms, indices, w, v, sign):
                    return w, *v
        return None

    # -- lengths ----------------------------------------------------------------------------------

    def _of_correction(self, vector: Sequence[Node]) -> float:
        """Squared length of k r^p, r the inverse root of |q k|^2 with a limit."""
        parts: list[Node | float] = []
        root: tuple[Node, int] | None = None
        for node in vector:
            form = polynomial_of(bare(node, self.aliases), _TERMS, _DEPTH, (), self.aliases) or {}
            if len(form) != 1:
                return math.inf
            ((monomial, c),) = form.items()
            roots = [n for n in monomial if self.nodes[n].kind == "rsqrt"]
            others = [n for n in monomial if self.nodes[n].kind != "rsqrt"]
            if not roots or len({*roots}) > 1 or len(others) > 1 or (others and c != 1.0):
                return math.inf
            if root not in (None, (self.nodes[roots[0]], len(roots))):
                return math.inf
            root = self.nodes[roots[0]], len(roots)
            parts.append(self.nodes[others[0]] if others else c)
        if root is None or root[1] > 2 or sum(isinstance(k, float) for k in parts) > 1:
            return math.inf
        limit, ratio = self._limit_and_ratio(root[0].args[0], parts)
        if ratio < 1.0:
            return math.inf
        ends = [(k, k) if isinstance(k, float) else (k.low, k.high) for k in parts]
        self.used |= {k.number for k in parts if isinstance(k, Node)}
        upper = sum(max(a * a, b * b) for a, b in ends)
        lower = sum(0.0 if a < 0.0 < b else min(a * a, b * b) for a, b in ends)
        if root[1] == 1:
            return max(1.0, upper / limit)
        return max(1.0 / lower if lower else math.inf, upper / (limit * limit))

    def _limit_and_ratio(self, total: Node, parts: Sequence[Node | float]) -> tuple[float, float]:
        """Limit of a radicand, and the least ratio of the unlimited one to |k|^2."""
        limit = math.inf
        while total.kind in ("bounded", "saturated"):
            if total.kind == "bounded":
                self.aliases.add(total.number)
            else:
                limit = min(limit, total.value)
            total = total.args[0]
        form = polynomial_of(total, _TERMS, _DEPTH, (), self.aliases)
        numbers = [k.number for k in parts if isinstance(k, Node)]
        if form is None or len({*numbers}) < len(numbers) or not numbers:
            return limit, 0.0
        factor = quotient(form, numbers[0], 2)  # |q|^2, if |k|^2 is the other factor
        square: Polynomial = {(n, n): 1.0 for n in numbers}
        for k in parts:
            if isinstance(k, float):
                square = plus(square, {(): k * k})
        rest = plus(form, scaled(times(factor, square, _TERMS) or {}, -1.0))
        if not is_zero(rest):
            return limit, 0.0
        return limit, self._least_of(factor)

    def _least(self, vector: Sequence[Node]) -> float:
        """Lower bound of the squared length of a vector of nodes, or 0."""
        limit = math.inf
        inner = []
        for node in vector:
            while node.kind in ("bounded", "saturated"):
                if node.kind == "bounded":
                    self.aliases.add(node.number)
                else:  # a component at its limit has this square
                    limit = min(limit, node.value * node.value)
                node = node.args[0]
            inner.append(node)
        numbers = [n.number for n in inner if n.kind != "const"]
        if len({*numbers}) < len(numbers):
            return 0.0
        lower = 0.0
        for method in (
            *(self._of_constants, self._selected, self._divided, self._sine_cosine),
            *(self._multiplied, self._of_states, self._radial),
        ):
            lower = max(lower, method(inner))
            if lower >= 1.0:
                break
        return min(limit, _exact(lower))

    def _of_constants(self, vector: Sequence[Node]) -> float:
        return sum(n.value * n.value for n in vector if n.kind == "const")

    def _selected(self, vector: Sequence[Node]) -> float:
        """Of a vector that one condition selects."""
        conditions = {n.args[0].number for n in vector if n.kind == "select"}
        if len(conditions) != 1 or any(n.kind != "select" for n in vector):
            return 0.0
        return min(self._least([n.args[k] for n in vector]) for k in (1, 2))

    def _divided(self, vector: Sequence[Node]) -> float:
        """Of a vector that is not 0, divided by its length, or by less."""
        for factor in vector[0].args if vector[0].kind == "mul" else ():
            root = factor
            while root.kind == "bounded":
                self.aliases.add(root.number)
                root = root.args[0]
            if any(n.kind != "mul" or factor not in n.args for n in vector):
                continue
            if root.kind != "rsqrt":
                continue
            parts = [n.args[1 - n.args.index(factor)] for n in vector]
            total = bare(root.args[0], self.aliases)
            form = polynomial_of(total, _TERMS, _DEPTH, {p.number for p in parts}, self.aliases)
            if form == {(p.number, p.number): 1.0 for p in parts} and self._least(parts) > 0.0:
                return 1.0
        return 0.0

    def _sine_cosine(self, vector: Sequence[Node]) -> float:
        """Of a sine and its cosine."""
        waves = {(n.args[0].number, n.quarter) for n in vector if n.kind == "sin"}
        return 1.0 if any((angle, not quarter) in waves for angle, quarter in waves) else 0.0

    def _multiplied(self, vector: Sequence[Node]) -> float:
        """Of a product of quaternions."""
        form = self._squares(vector, {a.number for n in vector for a in _factors(n)})
        for n in sorted({*next(iter(form), ())}):
            first = quotient(form, n, 2)
            second = quotient(form, next((m[0] for m in first if m), n), 2)
            rest = plus(form, scaled(times(first, second, _TERMS) or {}, -1.0))
            if first and second and is_zero(rest):
                return self._least_of(first) * self._least_of(second)
        return 0.0

    def _least_of(self, form: Polynomial) -> float:
        """Lower bound of a constant and the squares of a vector; 0 for another polynomial."""
        if any(abs(c - 1.0) > _TINY or m[0] != m[-1] for m, c in form.items() if m):
            return 0.0
        if any(len(m) not in (0, 2) for m in form):
            return 0.0
        vector = [self.nodes[m[0]] for m in form if m]
        return max(0.0, form.get((), 0.0)) + (self._least(vector) if vector else 0.0)

    def _of_states(self, vector: Sequence[Node]) -> float:
        """Of states that begin no shorter than one and never become shorter."""
        key = frozenset(n.number for n in vector)
        if not key or any(n.number not in self.after for n in vector):
            return 0.0
        if key not in self.long:
            previous = dict(self.long)
            self.long[key] = Ball(key)  # assumed
            outer, self.used, self.aliases = (self.used, self.aliases), set(), set()
            numbers = sorted(key)
            is_long = sum(self.first[n] ** 2 for n in numbers) >= 1.0 - _ROUNDING
            is_invariant = is_long and self._least([self.after[n] for n in numbers]) >= 1.0
            new_ball = Ball(key, frozenset(self.used), frozenset(self.aliases))
            self.long = self.long | {key: new_ball} if is_invariant else previous | {key: None}
            self.used, self.aliases = outer
        ball = self.long[key]
        if ball is None:
            return 0.0
        self.used |= ball.used
        self.aliases |= ball.aliases
        return 1.0

    def _radial(self, vector: Sequence[Node]) -> float:
        """Of a vector whose squared length is a polynomial of another squared length."""
        polynomial = radial(self._squares(vector, ()))
        if polynomial is None:
            return 0.0
        upper = sum(max(n.low**2, n.high**2) for n in (self.nodes[k] for k in polynomial.numbers))
        self.used |= {*polynomial.numbers}
        return polynomial.ends(upper)[0]

    def _squares(self, vector: Sequence[Node], ends: Sequence[int] | set[int]) -> Polynomial:
        """Sum of the squares of nodes; empty: of too many terms."""
        total: Polynomial = {}
        for node in vector:
            form = polynomial_of(node, _TERMS, _DEPTH, ends, self.aliases)
            square = None if form is None else times(form, form, _TERMS)
            if square is None:
                return {}
            total = plus(total, square)
        return {m: c for m, c in total.items() if abs(c) > _TINY}


def _exact(square: float) -> float:
    """A bound of a squared length, rounded to one if it is close."""
    return 1.0 if abs(square - 1.0) <= _ROUNDING else square


def _signed(c: Coefficient) -> Coefficient:
    """A coefficient with the sign of its node moved to its number."""
    number, nodes = c.number, c.nodes
    while len(nodes) == 1 and nodes[0].kind == "sum" and len(nodes[0].args) == 1:
        number, nodes = number * nodes[0].signs[0], nodes[0].args
    return Coefficient(number, nodes, c.sides)


def _factors(node: Node) -> Iterator[Node]:
    """Factors of the products whose sum a node is, without their signs."""
    if node.kind in ("sum", "mul"):
        for arg in node.args:
            is_inner = arg.kind == "sum" or (node.kind == "sum" and arg.kind == "mul")
            yield from _factors(arg) if is_inner else (arg,)


def _rest(forms: Sequence[Sequence[Polynomial]], i: int, j: int, total: Polynomial) -> Polynomial:
    """Element of |c|^2 1 - M^T M."""
    out = dict(total) if i == j else {}
    for row in forms:
        out = plus(out, scaled(times(row[i], row[j], _TERMS) or {}, -1.0))
    return {m: c for m, c in out.items() if abs(c) > _TINY}


def _is_rotation(
    forms: Sequence[Sequence[Polynomial]],
    indices: Sequence[int],
    w: int,
    v: Sequence[int],
    sign: float,
) -> bool:
    """Whether forms are rows of 1 + 2 w [v x] + 2 [v x]^2, w with a sign."""
    return all(
        is_zero(plus(form, scaled(element(w, v, i, j, sign), -1.0)))
        for row, i in zip(forms, indices, strict=True)
        for j, form in enumerate(row)
    )
