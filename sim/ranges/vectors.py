"""Proof of a range by the length of vectors, which intervals do not express.

The components c_i / sqrt(S), S >= sum of c_i^2, are a vector within the unit ball, and so are the
sine and cosine of an angle, and states that every update replaces by such a vector. A value is
expanded to a polynomial of what it is computed from, and its range follows from

* what `balls` says of polynomials of the components of such vectors;
* Cauchy-Schwarz, where it is linear in the components of another: |sum b_i p_i| <= |b| |p|;
* |p|^2 = |a|^2 |b|^2 of a product of quaternions, and |A p| of `turned`;
* |C a| <= |a| of the rotation matrix of a quaternion.

A component that is limited, also by the format of its word, is not longer than without: no length
depends on the claims of a vector's own components.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from functools import cache, partial
from typing import Any

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.ranges.balls import DEPTH, TERMS, Balls, absorbed, largest_eigenvalue
from boresight.sim.ranges.claims import Claim, Proof
from boresight.sim.ranges.low_passes import Forms, LowPass, low_passes_of, near
from boresight.sim.ranges.polynomials import Expansions, Polynomial, plus, scaled, times
from boresight.sim.ranges.radial import radial_balls
from boresight.sim.ranges.reductions import reductions_of
from boresight.sim.ranges.rotations import Rotation, rotations_of
from boresight.sim.ranges.steps import live_nodes
from boresight.sim.ranges.turned import turned_of
from boresight.sim.ranges.unit_vectors import Ball, UnitVectors, bare, under_root

__all__ = ["Vectors"]

#: Steps from a vector to the vectors from which its length follows.
_NESTED = 4
_ROUNDING = 1e-9


class Vectors(Balls):
    """The vectors of a compiled step.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """

    def __init__(self, program: Program, nodes: Mapping[int, Node]) -> None:
        super().__init__(live_nodes(program, nodes))
        self.squares: dict[tuple[tuple[int, ...], int], Ball] = {}
        self.after = {
            nodes[s].number: nodes[a] for s, a in program.states if s in nodes and a in nodes
        }
        balls = (*radial_balls(self.nodes), *UnitVectors(self.nodes).balls)
        self.balls = [*{ball.numbers: ball for ball in balls}.values()]
        self.members = frozenset[int]().union(*(ball.numbers for ball in self.balls))
        self.expansions: dict[frozenset[int], Expansions] = {}  # by where they end
        self.forms = Forms(self.nodes)
        self.waves = [*_waves(self.nodes)]
        self.low_passes = [*low_passes_of(program, nodes)]
        self.ends = self.members, self.members | self.bounded  # of forms
        self.reductions = [*reductions_of(self.nodes)]
        self.rotations: list[Rotation] = []
        self.lengths: dict[int, Ball] = {}  # why |p|^2 <= 2, by t
        for reduction in [*self.reductions]:
            for t, p in reduction.components.items():
                self.used, self.aliases = set(), set(reduction.aliases[t])
                if self._square(p) > 2.0:
                    self.reductions.remove(reduction)
                    break
                self.lengths[t] = Ball(frozenset(), frozenset(self.used), frozenset(self.aliases))
        self.first = {
            nodes[s].number: float(program.format(s).real(program.values[s].initial))
            for s, _ in program.states
            if s in nodes
        }
        self.balls += self._states()
        self.balls += self._reduced_states()
        count = len(self.balls)
        self.balls += self._turned(self.balls)
        self._count_members()
        self.balls += self._turned(self.balls[count:])  # a turned vector may be turned again
        self._count_members()
        self.rotations = [*rotations_of(self.nodes, self.balls)]

    def _count_members(self) -> None:
        """Let forms end at the components of all vectors so far."""
        self.members = self.members.union(*(ball.numbers for ball in self.balls))
        self.ends = self.members, self.members | self.bounded
        self.squares.clear()

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if the length of vectors decides it; None without a vector."""
        if not self.balls and not self.low_passes:
            return None
        self.used, self.aliases = set(), set()
        if not claim.holds(*self._ends(claim.node, claim.ends)):
            return None
        base, aliases = (
            tuple(self.nodes[n] for n in sorted(numbers)) for numbers in (self.used, self.aliases)
        )
        return Proof("length of vectors", base, aliases)

    def square_of(self, vector: Sequence[Node]) -> tuple[float, Ball]:
        """An upper bound of the squared length of a vector, with the premises of the bound."""
        self.used, self.aliases = set(), set()
        square = self._square(vector)
        numbers = frozenset(n.number for n in vector)
        return square, Ball(numbers, frozenset(self.used), frozenset(self.aliases))

    # -- vectors of known length ----------------------------------------------------------------

    def _states(self) -> Iterator[Ball]:
        """States that begin as a vector within the unit ball, and whose next values are one."""
        for ball in [*self.balls]:
            states = [
                s
                for s, node in self.after.items()
                if any(part.number in ball.numbers for part in _alternatives(node))
            ]
            if len(states) > 1 and (out := self._invariant(states, 1.0 + _ROUNDING)) is not None:
                yield out

    def _reduced_states(self) -> Iterator[Ball]:
        """States that begin as a vector within the unit ball and never become longer."""
        for reduction in self.reductions:
            states = [n.number for n in reduction.base]
            if not self.after.keys() >= {*states} or self._ball(states) is not None:
                continue
            assumption = Ball(frozenset(states))
            self.balls.append(assumption)
            self.squares.clear()
            out = self._invariant(states, 1.0)
            self.balls.remove(assumption)
            self.squares.clear()
            if out is not None:
                yield out

    def _turned(self, balls: Sequence[Ball]) -> Iterator[Ball]:
        """Products of matrices with orthogonal rows and other vectors."""
        for turned in turned_of(self.nodes, [*balls]):
            self.used, self.aliases = {*turned.ball.used}, {*turned.aliases, *turned.ball.aliases}
            square = turned.ball.square * max(map(self._row_square, turned.squares))
            if math.isfinite(square):
                yield Ball(turned.numbers, frozenset(self.used), frozenset(self.aliases), square)

    def _form_of(self, node: Node, ends: Set[int]) -> Polynomial | None:
        """A node as a polynomial of ``ends``, and of nodes other than products and sums."""
        key = frozenset(ends)
        if key not in self.expansions:
            self.expansions[key] = Expansions(TERMS, key)
        return self.expansions[key].of(node, DEPTH, self.aliases)

    def _row_square(self, form: Polynomial) -> float:
        """An upper bound of a sum of squares of polynomials."""

        def expanded(ends: Set[int]) -> float:
            expansion = self._expanded(form, ends)
            return math.inf if expansion is None else self._upper(expansion, 0.0)

        summed = {*self.sums}.union(*self.sums.values())
        methods = (partial(expanded, ends) for ends in (self.members, self.members | summed))
        return self._best((lambda: self._upper(form, 0.0), *methods))

    def _expanded(self, form: Polynomial, ends: Set[int]) -> Polynomial | None:
        """A polynomial with its nodes expanded back to ``ends``."""
        out: Polynomial | None = {}
        for m, c in form.items():
            part: Polynomial | None = {(): c}
            for n in m:
                factor = self._form_of(self.nodes[n], ends)
                part = None if part is None or factor is None else times(part, factor, TERMS)
            out = None if out is None or part is None else plus(out, part)
        return out

    def _invariant(self, states: Sequence[int], limit: float) -> Ball | None:
        """States whose first and next values are a vector within the unit ball."""
        self.used, self.aliases = set(), set()
        square = self._square([self.after[s] for s in states])
        if square > limit or sum(self.first[s] ** 2 for s in states) > 1.0 + _ROUNDING:
            return None
        return Ball(frozenset(states), frozenset(self.used), frozenset(self.aliases))

    # -- bounds ---------------------------------------------------------------------------------

    def _ends(self, node: Node, goal: tuple[float, float]) -> tuple[float, float]:
        """Ends of a node; no closer than the goal."""
        methods: tuple[Callable[[], float], ...] = (
            lambda: self._by_reduction(node, 0),
            lambda: self._by_reduction(node, _NESTED),
            lambda: math.sqrt(self._filtered([node])),
            lambda: math.sqrt(self._rotated([node])),
        )
        for method in methods:
            self.used, self.aliases = set(), set()
            upper = method()
            if upper <= min(-goal[0], goal[1]):
                return -upper, upper
        if under_root(node) is not None:
            self.used, self.aliases = set(), set()
            upper = math.sqrt(self._square([node]))
            if upper <= goal[1]:
                return 0.0, upper
        previous: Polynomial = {}
        for ends in self.ends:
            self.used, self.aliases = set(), set()
            form = self._form_of(node, ends)
            if form is None or form == previous:
                continue
            previous = form
            upper = self._upper(form, goal[1])
            lower = -self._upper(scaled(form, -1.0), -goal[0]) if upper <= goal[1] else -math.inf
            if goal[0] <= lower:
                return lower, upper
        return -math.inf, math.inf

    def _by_reduction(self, node: Node, nested: int) -> float:
        """Upper bound of a coefficient t or a remaining component of a reduction."""
        for reduction in self.reductions:
            parts = [*reduction.components]
            for k, t in enumerate(parts):
                if node is bare(self.nodes[t]):
                    for other in parts[: k + 1]:
                        self._take(self.lengths[other])
                    length = self._square(reduction.base, nested)
                    return math.sqrt(length * self._square(reduction.components[t], nested))
            if node.number in reduction.rest:
                return math.sqrt(self._reduced([node], nested + 1))
        return math.inf

    def _upper(self, form: Polynomial, goal: float) -> float:
        """An upper bound of a polynomial."""
        methods = (
            *(self._by_signs, self._by_eigenvalues, self._by_length, self._by_product),
            *(self._by_absorption, self._by_elimination),
        )
        return self._best((partial(method, form) for method in methods), goal)

    def _by_length(self, form: Polynomial) -> float:
        """Upper bound of a constant and squares of the components of one vector."""
        squares = {m: c for m, c in form.items() if m}
        if not squares or any(len(m) != 2 or m[0] != m[1] or c < 0.0 for m, c in squares.items()):
            return math.inf
        length = self._square([self.nodes[n] for n, _ in squares])
        return form.get((), 0.0) + max(squares.values()) * length

    def _of_absorbed(self, form: Polynomial) -> Iterator[Callable[[], float]]:
        yield from super()._of_absorbed(form)
        yield partial(self._by_length, form)

    def _by_product(self, form: Polynomial) -> float:
        """Cauchy-Schwarz, where every term has one component of a vector."""
        constant = form.get((), 0.0)
        form = {m: c for m, c in form.items() if m}

        def bound_of(vector: Sequence[int]) -> float:
            rows: dict[int, Polynomial] = {}
            for m, c in form.items():
                (component,) = (n for n in m if n in vector)
                rest = list(m)
                rest.remove(component)
                rows.setdefault(component, {})[tuple(rest)] = c
            total: Polynomial | None = {}
            for row in rows.values():
                square = times(row, row, TERMS)
                total = None if total is None or square is None else plus(total, square)
            if total is None:
                return math.inf
            length = self._square([self.nodes[n] for n in vector])
            methods = (self._by_signs, self._by_length, self._by_absorption, self._by_elimination)
            row_square = self._best(partial(method, total) for method in methods)
            return constant + math.sqrt(max(0.0, length * row_square))

        vectors = self._linear(form) if len(form) <= TERMS // 2 else ()
        return self._best(partial(bound_of, vector) for vector in vectors)

    def _square(self, vector: Sequence[Node], nested: int = _NESTED) -> float:
        """An upper bound of the squared length of a vector of nodes."""
        key = tuple(n.number for n in vector), nested
        if key not in self.squares:
            outer = self.used, self.aliases
            self.used, self.aliases = set(), set()
            square = self._new_square(vector, nested)
            premises = frozenset(self.used), frozenset(self.aliases)
            self.squares[key] = Ball(frozenset(), *premises, square)
            self.used, self.aliases = outer
        self._take(self.squares[key])
        return self.squares[key].square

    def _new_square(self, vector: Sequence[Node], nested: int) -> float:
        unlimited = [self._unlimited(n) for n in vector]
        methods: list[Callable[[], float]] = [lambda: self._by_intervals(vector)]
        variables = [n for n in vector if n.kind != "const"]
        if variables and len(variables) < len(vector):
            constants = sum(n.value * n.value for n in vector if n.kind == "const")
            methods.append(lambda: constants + self._square(variables, nested))
        for parts in (vector, unlimited):
            if not any(n.kind == "const" for n in parts):
                methods.append(partial(self._ball_square, [n.number for n in parts]))
            if any(wave.numbers == {n.number for n in parts} for wave in self.waves):
                methods.append(lambda: 1.0)
            methods.append(partial(self._rotated, parts))
        if nested:
            methods += [lambda: self._reduced(vector, nested), *self._ways(unlimited, nested)]
        return self._best(methods)

    def _unlimited(self, node: Node) -> Node:
        """A node without its limits, down to a component of a vector of known length."""
        while node.kind in ("bounded", "saturated") and node.number not in self.members:
            node = node.args[0]
        return node

    def _by_intervals(self, vector: Sequence[Node]) -> float:
        total = 0.0
        for node in vector:
            square, number = min((max(n.low**2, n.high**2), n.number) for n in _limit_chain(node))
            self.used.add(number)
            total += square
        return total

    def _ways(self, vector: Sequence[Node], nested: int) -> Iterator[Callable[[], float]]:
        """Ways to bound the squared length of a vector of nodes."""
        yield lambda: self._filtered(vector)
        if len(vector) == 1:
            yield lambda: self._of_component(vector[0])
        conditions = [n.args[0] for n in vector if n.kind == "select"]
        if conditions:
            c = conditions[0]
            sides = [
                [n.args[k] if n.kind == "select" and n.args[0] is c else n for n in vector]
                for k in (1, 2)
            ]
            yield lambda: max(self._square(side, nested - 1) for side in sides)
            return
        for ends in reversed(self.ends):
            total = cache(partial(self._summed_squares, vector, ends))
            for method in (
                *(self._by_signs, self._by_absorption, self._by_elimination),
                lambda total: self._by_factors(total, nested),
                lambda total: self._by_quadratic(total, vector, nested),
            ):
                yield partial(self._of_total, total, method)

    def _of_total(
        self,
        total: Callable[[], tuple[Polynomial | None, frozenset[int]]],
        method: Callable[[Polynomial], float],
    ) -> float:
        """Upper bound of a sum of squares by a method."""
        form, aliases = total()
        self.aliases |= aliases
        return math.inf if form is None else method(form)

    def _filtered(self, vector: Sequence[Node]) -> float:
        """Squared length of a vector whose components are samples after equal low-passes."""
        if not self.low_passes or len({n.number for n in vector}) < len(vector):
            return math.inf
        candidates = [self._filter_of(node) for node in vector]
        filters = [f for f in candidates if f is not None]
        samples = [low_pass.sample for low_pass, _, _ in filters]
        if len(filters) < len(vector) or len({n.number for n in samples}) < len(samples):
            return math.inf
        (first, gain, forms), *others = filters
        if any(not first.is_like(other) or forms != its for other, _, its in others):
            return math.inf
        return gain * gain * self._square(samples)

    def _filter_of(self, node: Node) -> tuple[LowPass, float, list[Any]] | None:
        """The low-pass of which a node is a form, its gain for samples up to one, and the forms."""
        for low_pass in self.low_passes:
            states = {low_pass.z.number, low_pass.v.number}
            if not near(node, states):
                continue
            counter = low_pass.counting[2] if low_pass.counting else None
            aliases = {*low_pass.aliases}
            gain, forms = 0.0, list[Any]()
            for sides, form in self.forms.of(node, states, counter, aliases):
                if form is None:
                    break
                gain = max(gain, low_pass.largest(form, sides))
                forms.append((sides, low_pass.alike(form)))
            else:
                if math.isfinite(gain):
                    self.aliases |= aliases
                    return low_pass, gain, forms
        return None

    def _reduced(self, vector: Sequence[Node], nested: int) -> float:
        """Squared length of a vector, some components of which remain from a reduction."""
        for reduction in self.reductions:
            rest = [n for n in vector if self._unlimited(n).number not in reduction.rest]
            original = [*rest, *reduction.base]
            distinct = len({n.number for n in (*vector, *reduction.base)})
            if len(rest) < len(vector) and distinct == len(vector) + len(reduction.base):
                for t in reduction.components:
                    self._take(self.lengths[t])
                return self._square(original, nested - 1)
        return math.inf

    def _rotated(self, vector: Sequence[Node]) -> float:
        """Squared length of a rotated vector."""
        for rotation in self.rotations:
            aliases = set[int]()
            parts = rotation.turned(vector, aliases)
            if parts is not None:
                self._take(rotation.ball)
                self.aliases |= aliases
                return self._best((partial(self._by_ends, parts), partial(self._by_squares, parts)))
        return math.inf

    def _by_ends(self, vector: Sequence[Polynomial]) -> float:
        """Squared length of a vector of polynomials, each by its ends."""
        return sum(max(self._by_signs(scaled(p, s)) for s in (1.0, -1.0)) ** 2 for p in vector)

    def _by_squares(self, vector: Sequence[Polynomial]) -> float:
        """The same, with s^2 + c^2 = 1 for the sine and cosine of each angle."""
        total: Polynomial = {}
        for p in vector:
            square = times(p, p, TERMS)
            if square is None:
                return math.inf
            total = plus(total, square)
        for wave in self.waves:
            total = absorbed(total, wave) or total
        return self._by_signs(total)

    def _of_component(self, node: Node) -> float:
        """Squared length of one component, by its ends."""
        form = self._form_of(node, self.members)
        if form is None:
            return math.inf
        return max(map(self._by_eigenvalues, (form, scaled(form, -1.0)))) ** 2

    def _summed_squares(
        self, vector: Sequence[Node], ends: Set[int]
    ) -> tuple[Polynomial | None, frozenset[int]]:
        """The sum, and the "bounded" nodes that count as their arguments in it."""
        outer, self.aliases = self.aliases, set()
        total: Polynomial | None = {}
        for node in vector:
            x = None if node.number in ends else under_root(node)
            form = self._form_of(x or node, ends)
            square = form if form is None or x else times(form, form, TERMS)
            if x is not None:
                self.aliases |= {n.number for n in _limit_chain(node) if n.kind == "bounded"}
            total = None if total is None or square is None else plus(total, square)
            if total is None:
                break
        aliases, self.aliases = frozenset(self.aliases), outer
        return total and {m: c for m, c in total.items() if abs(c) > 1e-12}, aliases

    def _by_quadratic(self, form: Polynomial, vector: Sequence[Node], nested: int) -> float:
        """Upper bound of a squared length that is a quadratic form of other nodes."""
        numbers = sorted({n for m in form for n in m})
        if any(len(m) != 2 for m in form) or {*numbers} <= {n.number for n in vector}:
            return math.inf
        largest = largest_eigenvalue(form, numbers)
        return largest * self._square([self.nodes[n] for n in numbers], nested - 1)

    def _by_factors(self, form: Polynomial, nested: int) -> float:
        """Upper bound of (sum of a_i^2) g, g without any a_i."""
        best = math.inf
        parts: dict[int, Polynomial] = {}
        for m, c in form.items():
            for k in {k for k in m if m.count(k) == 2}:
                parts.setdefault(k, {})[tuple(i for i in m if i != k)] = c
        for n in set(next(iter(form), ())):
            vector = [k for k, part in parts.items() if n in parts and _is_equal(part, parts[n])]
            if len(vector) * len(parts.get(n, ())) != len(form):
                continue
            rest = min(self._by_signs(parts[n]), self._by_factors(parts[n], nested))
            length = self._square([self.nodes[k] for k in vector], nested - 1)
            best = min(best, length * max(0.0, rest))
        return best


def _waves(nodes: Mapping[int, Node]) -> Iterator[Ball]:
    """The sine and the cosine of an angle."""
    waves = {(n.args[0].number, n.quarter): n.number for n in nodes.values() if n.kind == "sin"}
    for (angle, quarter), number in waves.items():
        if quarter and (angle, False) in waves:
            yield Ball(frozenset((number, waves[angle, False])))


def _limit_chain(node: Node) -> Iterator[Node]:
    """A node, and the arguments of its limits, one after the other."""
    yield node
    while node.kind in ("bounded", "saturated"):
        node = node.args[0]
        yield node


def _alternatives(node: Node) -> Iterator[Node]:
    """A node, the arguments of its limits, and each side of a selection."""
    yield node
    if node.kind in ("bounded", "saturated"):
        yield from _alternatives(node.args[0])
    elif node.kind == "select":
        for side in node.args[1:]:
            yield from _alternatives(side)


def _is_equal(a: Polynomial, b: Polynomial) -> bool:
    return a.keys() == b.keys() and all(abs(c - b[m]) <= 1e-12 for m, c in a.items())
