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
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from itertools import permutations
from typing import Any

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.ranges.boxes import Proof
from boresight.sim.ranges.claims import Claim
from boresight.sim.ranges.low_passes import Forms, LowPass, low_passes_of, near
from boresight.sim.ranges.polynomials import Polynomial, plus, polynomial_of, scaled, times
from boresight.sim.ranges.reductions import reductions_of
from boresight.sim.ranges.steps import live_nodes
from boresight.sim.ranges.unit_vectors import Ball, UnitVectors, bare

__all__ = ["Vectors"]

#: Terms of a polynomial, and those of its square; steps back to what it is computed from.
_TERMS, _DEPTH, _NESTED = 100, 24, 4
_ROUNDING = 1e-9


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
        self.balls = [*{ball.numbers: ball for ball in UnitVectors(self.nodes).balls}.values()]
        self.members = set[int]().union(*(ball.numbers for ball in self.balls))
        self.forms = Forms(self.nodes)
        self.low_passes = [*low_passes_of(program, nodes)]
        self.reductions = [*reductions_of(self.nodes)]
        self.lengths: dict[int, Ball] = {}  # why |p|^2 <= 2, by t
        for found in [*self.reductions]:
            for t, p in found.along.items():
                self.used, self.passed = set(), set(found.passed[t])
                if self._square(p) > 2.0:
                    self.reductions.remove(found)
                    break
                self.lengths[t] = Ball(frozenset(), frozenset(self.used), frozenset(self.passed))
        self.first = {
            nodes[s].number: float(program.format(s).real(program.values[s].initial))
            for s, _ in program.states
            if s in nodes
        }
        self.balls += self._states()
        self.balls += self._reduced_states()

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if the length of vectors decides it; None without a vector."""
        if not self.balls and not self.low_passes:
            return None
        self.used, self.passed = set(), set()
        low, high = claim.ends
        least, most = self._ends(claim.node, (low, high))
        if not (low <= least and most <= high):
            return None
        base, passed = (
            tuple(self.nodes[n] for n in sorted(each)) for each in (self.used, self.passed)
        )
        return Proof("length of vectors", base, passed)

    def square_of(self, vector: Sequence[Node]) -> tuple[float, Ball]:
        """An upper bound of the squared length of a vector, and what tells it."""
        self.used, self.passed = set(), set()
        square = self._square(vector)
        numbers = frozenset(n.number for n in vector)
        return square, Ball(numbers, frozenset(self.used), frozenset(self.passed))

    # -- which vectors there are ----------------------------------------------------------------

    def _states(self) -> Iterator[Ball]:
        """States that begin as a vector within the unit ball, and are replaced by one each time."""
        for ball in [*self.balls]:
            chosen = [
                s
                for s, node in self.after.items()
                if any(part.number in ball.numbers for part in _alternatives(node))
            ]
            if len(chosen) > 1 and (found := self._kept(chosen, 1.0 + _ROUNDING)) is not None:
                yield found

    def _reduced_states(self) -> Iterator[Ball]:
        """States that begin as a vector within the unit ball, and become one that is no longer."""
        for reduction in self.reductions:
            chosen = [n.number for n in reduction.base]
            if not self.after.keys() >= {*chosen} or self._ball(chosen) is not None:
                continue
            assumed = Ball(frozenset(chosen))
            self.balls.append(assumed)
            found = self._kept(chosen, 1.0)
            self.balls.remove(assumed)
            if found is not None:
                yield found

    def _kept(self, states: Sequence[int], most: float) -> Ball | None:
        """States whose first and next values are a vector within the unit ball."""
        self.used, self.passed = set(), set()
        square = self._square([self.after[s] for s in states])
        if square > most or sum(self.first[s] ** 2 for s in states) > 1.0 + _ROUNDING:
            return None
        return Ball(frozenset(states), frozenset(self.used), frozenset(self.passed))

    # -- what follows ---------------------------------------------------------------------------

    def _ends(self, node: Node, wanted: tuple[float, float]) -> tuple[float, float]:
        """Ends of a node; no closer than wanted."""
        ways: tuple[Callable[[], float], ...] = (
            lambda: self._by_reduction(node, 0),
            lambda: self._by_reduction(node, _NESTED),
            lambda: math.sqrt(self._filtered([node])),
        )
        for way in ways:
            self.used, self.passed = set(), set()
            most = way()
            if most <= min(-wanted[0], wanted[1]):
                return -most, most
        self.used, self.passed = set(), set()
        form = polynomial_of(node, _TERMS, _DEPTH, self.members, self.passed)
        if form is None:
            return -math.inf, math.inf
        most = self._most(form, wanted[1])
        least = -self._most(scaled(form, -1.0), -wanted[0]) if most <= wanted[1] else -math.inf
        return least, most

    def _by_reduction(self, node: Node, nested: int) -> float:
        """Of a part that a reduction takes, or of a component that it leaves."""
        for reduction in self.reductions:
            parts = [*reduction.along]
            for k, t in enumerate(parts):
                if node is bare(self.nodes[t]):
                    for other in parts[: k + 1]:
                        self._take(self.lengths[other])
                    length = self._square(reduction.base, nested)
                    return math.sqrt(length * self._square(reduction.along[t], nested))
            if node.number in reduction.rest:
                return math.sqrt(self._reduced([node], nested + 1))
        return math.inf

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

    def _ball(self, numbers: Sequence[int]) -> Ball | None:
        """A vector that has these components, and perhaps others."""
        inside = (ball for ball in self.balls if ball.numbers.issuperset(numbers))
        return next(inside, None)

    def _ball_square(self, numbers: Sequence[int]) -> float:
        ball = self._ball(numbers)
        if ball is None:
            return math.inf
        self._take(ball)
        return 1.0

    def _take(self, ball: Ball) -> None:
        self.used |= ball.used
        self.passed |= ball.passed

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
        balls = [present & ball.numbers for ball in self.balls]
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
            (ball for ball in self.balls if len(ball.numbers & numbers) > 1),
            key=lambda ball: (-len(ball.numbers & numbers), sorted(ball.numbers)),
        )[:2]
        best = math.inf
        for order in permutations(balls):
            forms = [form]
            for k, ball in enumerate(order):
                self._take(ball)
                forms = [
                    out
                    for f in forms
                    for n in sorted(ball.numbers & numbers)
                    if (out := _replaced(f, n, ball.numbers, -1 - k)) is not None
                ]
            best = min([best, *(self._by_signs(f) for f in forms)])
        return best

    def _square(self, vector: Sequence[Node], nested: int = _NESTED) -> float:
        """An upper bound of the squared length of a vector of nodes."""
        best = sum(max(n.low * n.low, n.high * n.high) for n in vector)
        used = {n.number for n in vector}
        inner = [bare(n) for n in vector]
        for parts in (vector, inner):
            ball = self._ball_square([n.number for n in parts if n.kind != "const"])
            if ball < best and not any(n.kind == "const" for n in parts):
                best, used = ball, set()
        if nested == 0:
            self.used |= used
            return best
        before = self.used, self.passed
        passed = {n.number for node in vector for n in _limits(node) if n.kind == "bounded"}
        known = used, set[int]()
        for way in self._ways(inner, nested):
            self.used, self.passed = set(), set(passed)
            square = way()
            if square < best * (1.0 - _ROUNDING):
                best, known = square, (self.used, self.passed)
        self.used, self.passed = before[0] | known[0], before[1] | known[1]
        return best

    def _ways(self, vector: Sequence[Node], nested: int) -> Iterator[Callable[[], float]]:
        """Ways to bound the squared length of a vector of nodes."""
        yield lambda: self._filtered(vector)
        yield lambda: self._reduced(vector, nested)
        conditions = [n.args[0] for n in vector if n.kind == "select"]
        if conditions:
            c = conditions[0]
            sides = [
                [n.args[k] if n.kind == "select" and n.args[0] is c else n for n in vector]
                for k in (1, 2)
            ]
            yield lambda: max(self._square(side, nested - 1) for side in sides)
            return
        for ends in (self.members | self.said, self.members):
            for method in (
                *(self._by_signs, self._by_elimination),
                lambda total: self._factors(total, nested),
            ):

                def way(ends: Set[int] = ends, method: Callable[..., float] = method) -> float:
                    total = self._summed_squares(vector, ends)
                    return math.inf if total is None else method(total)

                yield way

    def _filtered(self, vector: Sequence[Node]) -> float:
        """Of a vector whose components low-passes make alike of those of a sample."""
        if not self.low_passes or len({n.number for n in vector}) < len(vector):
            return math.inf
        found = [self._filter_of(node) for node in vector]
        known = [f for f in found if f is not None]
        samples = [low_pass.sample for low_pass, _, _ in known]
        if len(known) < len(vector) or len({n.number for n in samples}) < len(samples):
            return math.inf
        (first, gain, forms), *others = known
        if any(not first.is_like(other) or forms != its for other, _, its in others):
            return math.inf
        return gain * gain * self._square(samples)

    def _filter_of(self, node: Node) -> tuple[LowPass, float, list[Any]] | None:
        """Of which low-pass a node is a form, the largest of it of samples up to one, and which."""
        for low_pass in self.low_passes:
            own = {low_pass.z.number, low_pass.v.number}
            if not near(node, own):
                continue
            counter = low_pass.counting[2] if low_pass.counting else None
            passed = {*low_pass.passed}
            gain, forms = 0.0, list[Any]()
            for sides, form in self.forms.of(node, own, counter, passed):
                if form is None:
                    break
                gain = max(gain, low_pass.largest(form, sides))
                forms.append((sides, low_pass.alike(form)))
            else:
                if math.isfinite(gain):
                    self.passed |= passed
                    return low_pass, gain, forms
        return None

    def _reduced(self, vector: Sequence[Node], nested: int) -> float:
        """Of a vector, some components of which are what a reduction leaves."""
        for reduction in self.reductions:
            rest = [n for n in vector if n.number not in reduction.rest]
            before = [*rest, *reduction.base]
            distinct = len({n.number for n in (*vector, *reduction.base)})
            if len(rest) < len(vector) and distinct == len(vector) + len(reduction.base):
                for t in reduction.along:
                    self._take(self.lengths[t])
                return self._square(before, nested - 1)
        return math.inf

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


def _replaced(form: Polynomial, number: int, ball: Set[int], rest: int) -> Polynomial | None:
    """A polynomial with one less the other squares and a rest for the square of a node."""
    by: Polynomial = {(): 1.0, (rest,): -1.0}
    by |= {(n, n): -1.0 for n in ball if n != number}
    out: Polynomial | None = {}
    for m, c in form.items():
        power, odd = divmod(m.count(number), 2)
        part: Polynomial | None = {tuple(n for n in m if n != number) + (number,) * odd: c}
        for _ in range(power):
            part = None if part is None else times(part, by, _TERMS)
        out = None if out is None or part is None else plus(out, part)
    return None if out is None else {m: c for m, c in out.items() if abs(c) > 1e-12}
