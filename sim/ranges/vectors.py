"""Proof of a range by the length of vectors, which no interval holds.

The components c_i / sqrt(S), S >= sum of c_i^2, are a vector within the unit ball, and so are
states that every update replaces by such a vector. A value is expanded to a polynomial of what it
is computed from, and its range follows from

* the eigenvalues of a quadratic form of the components of one vector;
* Cauchy-Schwarz, where it is linear in the components of another: |sum b_i p_i| <= |b| |p|;
* |p|^2 as a polynomial in which r^2 less the other squares and a rest, which cannot be negative,
  replaces one square of a vector of length r: what stays has a sign, or an interval;
* |p|^2 = |a|^2 |b|^2 of a product of quaternions.

A saturated component is none the longer.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence, Set
from itertools import permutations

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.ranges.boxes import Proof
from boresight.sim.ranges.claims import Claim
from boresight.sim.ranges.polynomials import (
    Polynomial,
    is_sum_of_squares,
    plus,
    polynomial_of,
    scaled,
    times,
)
from boresight.sim.ranges.steps import live_nodes

__all__ = ["Vectors"]

#: Terms of a polynomial, and those of its square; steps back to what it is computed from.
_TERMS, _DEPTH, _NESTED = 100, 24, 4
_ROUNDING = 1e-9
#: A vector within a ball: numbers of its components, the squared radius.
Ball = tuple[frozenset[int], float]


class Vectors:
    """The vectors of a compiled step.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """

    def __init__(self, program: Program, nodes: Mapping[int, Node]) -> None:
        self.nodes = live_nodes(program, nodes)
        self.said = {n.number for n in self.nodes.values() if n.kind == "bounded"}
        self.used: set[int] = set()
        self.passed: set[int] = set()
        self.after = {
            nodes[s].number: nodes[a] for s, a in program.states if s in nodes and a in nodes
        }
        self.balls: list[Ball] = list(self._unit_vectors())
        self.members = set[int]().union(*(ball for ball, _ in self.balls))
        self.balls += self._states(program, nodes)
        self.of_vectors = self.passed

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if the length of vectors decides it; None without a vector."""
        if not self.balls:
            return None
        self.used, self.passed = set(), set(self.of_vectors)
        low, high = claim.ends
        least, most = self._ends(claim.node, (low, high))
        if not (low <= least and most <= high):
            return None
        base, passed = (
            tuple(self.nodes[n] for n in sorted(each)) for each in (self.used, self.passed)
        )
        return Proof("length of vectors", base, passed)

    # -- which vectors there are ----------------------------------------------------------------

    def _unit_vectors(self) -> Iterator[Ball]:
        """Components that one inverse root divides."""
        parts: dict[int, dict[int, Node]] = {}
        for node in self.nodes.values():
            inner = _bare(node)
            if inner.kind == "mul":
                for c, root in (inner.args, inner.args[::-1]):
                    if root.kind == "rsqrt":
                        parts.setdefault(root.number, {})[node.number] = c
                        break
        for divisor, found in parts.items():
            each: dict[int, list[int]] = {}  # a component, also saturated, by what it is made from
            for number, part_of in found.items():
                each.setdefault(part_of.number, []).append(number)
            for ends in (each.keys(), ()):
                passed = set[int]()
                members = self._squares_below(divisor, each, ends, passed)
                if len(members) > 1:
                    self.passed |= passed
                    for k in range(max(map(len, members))):
                        yield frozenset(m[min(k, len(m) - 1)] for m in members), 1.0
                    break

    def _squares_below(
        self, divisor: int, each: Mapping[int, list[int]], ends: Container[int], passed: set[int]
    ) -> list[list[int]]:
        """Components whose squares together are at most what the root is of."""
        rest = polynomial_of(self.nodes[divisor].args[0], _TERMS, _DEPTH, ends, passed)
        members = list[list[int]]()
        for made_from, numbers in each.items():
            part = polynomial_of(self.nodes[made_from], _TERMS, _DEPTH, ends, passed)
            square = None if part is None else times(part, part, _TERMS)
            if rest is None or square is None:
                continue
            less = plus(rest, scaled(square, -1.0))
            if is_sum_of_squares(less):
                rest, members = less, [*members, numbers]
        return members

    def _states(self, program: Program, nodes: Mapping[int, Node]) -> Iterator[Ball]:
        """States that begin as a vector within the unit ball, and are replaced by one each time."""
        after = self.after
        first = {
            nodes[s].number: float(program.format(s).real(program.values[s].initial))
            for s, _ in program.states
            if s in nodes
        }
        for ball, _ in list(self.balls):
            chosen = [
                s
                for s, node in after.items()
                if any(part.number in ball for part in _alternatives(node))
            ]
            start = sum(first[s] ** 2 for s in chosen)
            if len(chosen) < 2 or start > 1.0 + _ROUNDING:
                continue
            if self._square([after[s] for s in chosen]) <= 1.0 + _ROUNDING:
                yield frozenset(chosen), 1.0

    # -- what follows ---------------------------------------------------------------------------

    def _ends(self, node: Node, wanted: tuple[float, float]) -> tuple[float, float]:
        """Ends of a node; no closer than wanted."""
        form = polynomial_of(node, _TERMS, _DEPTH, self.members, self.passed)
        if form is None:
            return -math.inf, math.inf
        most = self._most(form, wanted[1])
        least = -self._most(scaled(form, -1.0), -wanted[0]) if most <= wanted[1] else -math.inf
        return least, most

    def _most(self, form: Polynomial, wanted: float) -> float:
        """An upper bound of a polynomial."""
        best = math.inf
        for way in (
            *(self._by_signs, self._by_eigenvalues, self._by_length),
            *(self._by_product, self._by_elimination),
        ):
            best = min(best, way(form))
            if best <= wanted:
                break
        return best

    def _by_signs(self, form: Polynomial) -> float:
        return sum(c * self._largest(m, c) for m, c in form.items())

    def _largest(self, monomial: tuple[int, ...], sign: float) -> float:
        """Least or largest value of a product of nodes; a rest, of a negative number, is 0 to 1."""
        low, high = 1.0, 1.0
        for number in sorted(set(monomial)):
            power = monomial.count(number)
            a, b = (0.0, 1.0) if number < 0 else (self.nodes[number].low, self.nodes[number].high)
            if number >= 0:
                self.used.add(number)
            ends = [a**power, b**power]
            if power % 2 == 0 and a < 0.0 < b:
                ends.append(0.0)
            corners = [x * y if x and y else 0.0 for x in (low, high) for y in ends]
            low, high = min(corners), max(corners)
        return high if sign > 0.0 else low

    def _by_eigenvalues(self, form: Polynomial) -> float:
        """Of a constant and a quadratic form of one vector."""
        numbers = sorted({n for m in form for n in m})
        square = self._ball_square(numbers)
        if not math.isfinite(square) or any(len(m) not in (0, 2) for m in form):
            return math.inf
        at = {n: k for k, n in enumerate(numbers)}
        matrix = np.zeros((len(numbers), len(numbers)))
        for m, c in form.items():
            if m:
                matrix[at[m[0]], at[m[1]]] += 0.5 * c
                matrix[at[m[1]], at[m[0]]] += 0.5 * c
        largest = float(np.linalg.eigvalsh(matrix)[-1]) if numbers else 0.0
        return form.get((), 0.0) + max(0.0, largest) * square

    def _by_length(self, form: Polynomial) -> float:
        """Of a constant and squares of the components of one vector."""
        squares = {m: c for m, c in form.items() if m}
        if not squares or any(len(m) != 2 or m[0] != m[1] or c < 0.0 for m, c in squares.items()):
            return math.inf
        length = self._square([self.nodes[n] for n, _ in squares])
        return form.get((), 0.0) + max(squares.values()) * length

    def _ball_square(self, numbers: Sequence[int]) -> float:
        inside = [r for ball, r in self.balls if ball.issuperset(numbers)]
        return min(inside, default=math.inf)

    def _by_product(self, form: Polynomial) -> float:
        """Cauchy-Schwarz, where every term has one component of a vector."""
        best, alone = math.inf, form.get((), 0.0)
        form = {m: c for m, c in form.items() if m}
        for vector in self._linear(form) if len(form) <= _TERMS // 2 else ():
            rows: dict[int, Polynomial] = {}
            for m, c in form.items():
                (own,) = (n for n in m if n in vector)
                rest = list(m)
                rest.remove(own)
                rows.setdefault(own, {})[tuple(rest)] = c
            total: Polynomial | None = {}
            for row in rows.values():
                square = times(row, row, _TERMS)
                total = None if total is None or square is None else plus(total, square)
            if total is None:
                continue
            length = self._square([self.nodes[n] for n in vector])
            other = min(self._by_signs(total), self._by_elimination(total))
            best = min(best, alone + math.sqrt(max(0.0, length * other)))
        return best

    def _linear(self, form: Polynomial) -> Iterator[list[int]]:
        """Sets of nodes of which every term has exactly one."""
        present = {n for m in form for n in m}
        inputs = {n for n in present if self.nodes[n].kind == "input"}
        states = {n for n in present if self.nodes[n].kind == "state"}
        balls = [present & ball for ball, _ in self.balls]
        bound = set().union(*balls)
        tried = []
        for vector in (*balls, inputs, states - bound, present - bound):
            if (
                vector
                and vector not in tried
                and all(sum(n in vector for n in m) == 1 for m in form)
            ):
                tried.append(vector)
                yield sorted(vector)

    def _by_elimination(self, form: Polynomial) -> float:
        """Of what is left where other squares and a rest replace one square of each vector."""
        numbers = {n for m in form for n in m}
        balls = sorted(
            {(tuple(sorted(ball)), r) for ball, r in self.balls if len(ball & numbers) > 1},
            key=lambda found: -len(numbers.intersection(found[0])),
        )[:2]
        best = math.inf
        for order in permutations(balls):
            forms = [form]
            for k, (ball, square) in enumerate(order):
                forms = [
                    out
                    for f in forms
                    for n in ball
                    if n in numbers and (out := _replaced(f, n, ball, square, -1 - k)) is not None
                ]
            best = min([best, *(self._by_signs(f) for f in forms)])
        return best

    def _square(self, vector: Sequence[Node], nested: int = _NESTED) -> float:
        """An upper bound of the squared length of a vector of nodes."""
        best = sum(max(n.low * n.low, n.high * n.high) for n in vector)
        used = {n.number for n in vector}
        bare = [_bare(n) for n in vector]
        for parts in (vector, bare):
            ball = self._ball_square([n.number for n in parts if n.kind != "const"])
            if ball < best and not any(n.kind == "const" for n in parts):
                best, used = ball, set()
        if nested == 0:
            self.used |= used
            return best
        before = self.used, self.passed
        self.used = set()
        self.passed = {n.number for node in vector for n in _limits(node) if n.kind == "bounded"}
        other = math.inf
        conditions = [n.args[0] for n in bare if n.kind == "select"]
        if conditions:
            c = conditions[0]
            sides = [
                [n.args[k] if n.kind == "select" and n.args[0] is c else n for n in bare]
                for k in (1, 2)
            ]
            other = max(self._square(side, nested - 1) for side in sides)
        else:
            for ends in (self.members | self.said, self.members):
                total = self._summed_squares(bare, ends)
                if total is not None:
                    ways = (self._by_signs(total), self._by_elimination(total))
                    other = min(other, *ways, self._factors(total, nested))
        passed: set[int] = set()
        if other < best:
            best, used, passed = other, self.used, self.passed
        self.used, self.passed = before[0] | used, before[1] | passed
        return best

    def _summed_squares(self, vector: Sequence[Node], ends: Set[int]) -> Polynomial | None:
        total: Polynomial = {}
        for node in vector:
            form = polynomial_of(node, _TERMS, _DEPTH, ends, self.passed)
            square = None if form is None else times(form, form, _TERMS)
            if square is None:
                return None
            total = plus(total, square)
        return {m: c for m, c in total.items() if abs(c) > 1e-12}

    def _factors(self, form: Polynomial, nested: int) -> float:
        """Of (sum of a_i^2) g, g without them."""
        best = math.inf
        for n in set(next(iter(form), ())):
            parts: dict[int, Polynomial] = {}
            for m, c in form.items():
                for k in {k for k in m if m.count(k) == 2}:
                    parts.setdefault(k, {})[tuple(i for i in m if i != k)] = c
            vector = [k for k, part in parts.items() if n in parts and _alike(part, parts[n])]
            if len(vector) * len(parts.get(n, ())) != len(form):
                continue
            rest = min(self._by_signs(parts[n]), self._factors(parts[n], nested))
            length = self._square([self.nodes[k] for k in vector], nested - 1)
            best = min(best, length * max(0.0, rest))
        return best


def _limits(node: Node) -> Iterator[Node]:
    """A node, and what it is but for limits, one after the other."""
    yield node
    while node.kind in ("bounded", "saturated"):
        node = node.args[0]
        yield node


def _bare(node: Node) -> Node:
    """What a node is but for limits."""
    return [*_limits(node)][-1]


def _alternatives(node: Node) -> Iterator[Node]:
    """A node, what it is but for limits, and each side of a selection."""
    yield node
    if node.kind in ("bounded", "saturated"):
        yield from _alternatives(node.args[0])
    elif node.kind == "select":
        for side in node.args[1:]:
            yield from _alternatives(side)


def _alike(a: Polynomial, b: Polynomial) -> bool:
    return a.keys() == b.keys() and all(abs(c - b[m]) <= 1e-12 for m, c in a.items())


def _replaced(
    form: Polynomial, number: int, ball: Sequence[int], square: float, rest: int
) -> Polynomial | None:
    """A polynomial with ``square`` less the other squares and a rest for the square of a node."""
    by: Polynomial = {(): square, (rest,): -square}
    by |= {(n, n): -1.0 for n in ball if n != number}
    out: Polynomial | None = {}
    for m, c in form.items():
        power, odd = divmod(m.count(number), 2)
        part: Polynomial | None = {tuple(n for n in m if n != number) + (number,) * odd: c}
        for _ in range(power):
            part = None if part is None else times(part, by, _TERMS)
        out = None if out is None or part is None else plus(out, part)
    return None if out is None else {m: c for m, c in out.items() if abs(c) > 1e-12}
