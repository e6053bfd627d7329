"""Upper bounds of polynomials of the components of vectors whose lengths are known.

* The eigenvalues of a quadratic form of one vector;
* a vector's squares with the same nonnegative factors are at most its squared length times these,
  as in (a^2 + b^2) c^2 + d^2 <= r^2 c^2 + d^2;
* r^2 less the other squares and a nonnegative rest replaces one square of a vector of length r, and
  a value that is a sum of squares replaces one of these: the remaining terms have a sign, or an
  interval.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from functools import partial
from itertools import permutations, product

import numpy as np

from boresight.model.lowering.graph import Node
from boresight.sim.ranges.polynomials import Polynomial, ends_of_product, times
from boresight.sim.ranges.unit_vectors import Ball

__all__ = ["DEPTH", "TERMS", "Balls", "absorbed", "largest_eigenvalue"]

#: Terms of a polynomial; steps back to its variables.
TERMS, DEPTH = 100, 24
#: Terms of an inner product that is split in every way; share of a bound that rounding explains.
_PARTED, _ROUNDING = 6, 1e-9


class Balls:
    """Vectors of known length, and bounds of polynomials of their components.

    Attributes
    ----------
    balls : list of Ball
    used, aliases : set of int
        Premises of the bounds since the sets were emptied: nodes whose intervals they use, and
        "bounded" ones that count as their arguments.
    """

    def __init__(self, nodes: Mapping[int, Node]) -> None:
        self.nodes = nodes
        self.bounded = {n.number for n in nodes.values() if n.kind == "bounded"}
        self.balls: list[Ball] = []
        self.used: set[int] = set()
        self.aliases: set[int] = set()
        self.products: dict[tuple[int, ...], tuple[float, float]] = {}  # ends of monomials
        self.sums: dict[int, frozenset[int]] = {}  # nodes of sums of squares
        for node in nodes.values():
            squares = [*_squares(node)] if node.kind == "sum" else []
            if len({*squares}) == len(squares) > 1 and None not in squares:
                self.sums[node.number] = frozenset(n for n in squares if n is not None)

    def _best(self, methods: Iterable[Callable[[], float]], goal: float = -math.inf) -> float:
        """The least of some bounds, with its premises; of equals that with the fewest claims."""
        outer = self.used, self.aliases
        best, premises = math.inf, (set[int](), set[int]())
        for method in methods:
            self.used, self.aliases = set(), set()
            bound = method()
            fewer = len(self.used & self.bounded) < len(premises[0] & self.bounded)
            if bound < best * (1.0 - _ROUNDING) or (fewer and bound <= best * (1.0 + _ROUNDING)):
                best, premises = bound, (self.used, self.aliases)
            if best <= goal:
                break
        self.used, self.aliases = outer[0] | premises[0], outer[1] | premises[1]
        return best

    def _ball(self, numbers: Sequence[int]) -> Ball | None:
        """A vector that has these components, possibly with others."""
        candidates = (ball for ball in self.balls if ball.numbers.issuperset(numbers))
        return next(candidates, None)

    def _ball_square(self, numbers: Sequence[int]) -> float:
        ball = self._ball(numbers)
        if ball is None:
            return math.inf
        self._take(ball)
        return ball.square

    def _take(self, ball: Ball) -> None:
        self.used |= ball.used
        self.aliases |= ball.aliases

    def _by_signs(self, form: Polynomial) -> float:
        self.used.update(n for n in set().union(*form) if n >= 0)
        for m in form:
            if m not in self.products:
                self.products[m] = self._ends_of(m)
        return sum(c * self.products[m][c > 0.0] for m, c in form.items())

    def _ends_of(self, monomial: tuple[int, ...]) -> tuple[float, float]:
        """Ends of a product of nodes; a rest, of a negative number, is 0 to 1."""
        ends = 1.0, 1.0
        for number in sorted(set(monomial)):
            base = (0.0, 1.0) if number < 0 else (self.nodes[number].low, self.nodes[number].high)
            ends = ends_of_product(ends, base, monomial.count(number))
        return ends

    def _by_eigenvalues(self, form: Polynomial) -> float:
        """Upper bound of a constant and a quadratic form of one vector."""
        numbers = sorted({n for m in form for n in m})
        square = self._ball_square(numbers)
        if not math.isfinite(square) or any(len(m) not in (0, 2) for m in form):
            return math.inf
        rest = {m: c for m, c in form.items() if m}
        return form.get((), 0.0) + largest_eigenvalue(rest, numbers) * square

    def _by_absorption(self, form: Polynomial) -> float:
        """Upper bound with the squares of vectors replaced by their lengths."""

        def bound_of(ball: Ball) -> float:
            rest = absorbed(form, ball)
            if rest is None:
                return math.inf
            self._take(ball)
            return self._best(self._of_absorbed(rest))

        return self._best(partial(bound_of, ball) for ball in self._overlapping(form))

    def _of_absorbed(self, form: Polynomial) -> Iterator[Callable[[], float]]:
        """Ways to bound a polynomial after an absorption."""
        for method in (self._by_signs, self._by_eigenvalues, self._by_absorption):
            yield partial(method, form)

    def _by_elimination(self, form: Polynomial) -> float:
        """Upper bound with one square of each vector, or of a sum of squares, replaced."""
        numbers = {n for m in form for n in m}

        def bound_of(order: Sequence[Ball]) -> float:
            forms = [form]
            for k, ball in enumerate(order):
                self._take(ball)
                total = {(): ball.square, (-1 - k,): -ball.square}
                forms = [
                    out
                    for f in forms
                    for n in sorted(ball.numbers & numbers)
                    if (out := _replaced(f, n, ball.numbers, total)) is not None
                ]
            return min(map(self._by_signs, forms), default=math.inf)

        def bound_without(number: int, squares: frozenset[int]) -> float:
            out = _replaced(form, min(squares), squares, {(number,): 1.0})
            return math.inf if out is None else self._by_signs(out)

        return self._best(
            (
                *(partial(bound_of, order) for order in permutations(self._overlapping(form)[:2])),
                *(partial(bound_without, n, s) for n, s in self.sums.items() if s <= numbers),
            )
        )

    def _overlapping(self, form: Polynomial) -> list[Ball]:
        """Vectors with several components in a polynomial, those with the most first."""
        numbers = {n for m in form for n in m}
        return sorted(
            (ball for ball in self.balls if len(ball.numbers & numbers) > 1),
            key=lambda ball: (-len(ball.numbers & numbers), sorted(ball.numbers)),
        )

    def _linear(self, form: Polynomial) -> Iterator[list[int]]:
        """Sets of nodes such that every term has exactly one of them."""
        numbers = {n for m in form for n in m}
        inputs = {n for n in numbers if self.nodes[n].kind == "input"}
        states = {n for n in numbers if self.nodes[n].kind == "state"}
        balls = [numbers & ball.numbers for ball in self.balls]
        members = set().union(*balls)
        visited = []
        is_small = len(form) <= _PARTED and all(0 < len(m) <= 2 for m in form)
        partitions = [*map(set, product(*form))] if is_small else []
        for vector in (*balls, inputs, states - members, numbers - members, *partitions):
            if (
                vector
                and vector not in visited
                and all(sum(n in vector for n in m) == 1 for m in form)
            ):
                visited.append(vector)
                yield sorted(vector)


def _squares(node: Node) -> Iterator[int | None]:
    """The nodes whose squares a sum consists of; None at the end: it has another term."""
    for arg, sign in zip(node.args, node.signs, strict=True):
        if arg.kind == "sum" and sign == 1:
            for number in _squares(arg):
                yield number
                if number is None:
                    return
        elif arg.kind == "mul" and arg.args[0] is arg.args[1] and sign == 1:
            yield arg.args[0].number
        else:
            yield None
            return


def largest_eigenvalue(form: Polynomial, numbers: Sequence[int]) -> float:
    """Largest eigenvalue of a quadratic form of nodes; not below 0."""
    index = {n: k for k, n in enumerate(numbers)}
    matrix = np.zeros((len(numbers), len(numbers)))
    for m, c in form.items():
        matrix[index[m[0]], index[m[1]]] += 0.5 * c
        matrix[index[m[1]], index[m[0]]] += 0.5 * c
    return max(0.0, float(np.linalg.eigvalsh(matrix)[-1])) if numbers else 0.0


def absorbed(form: Polynomial, ball: Ball) -> Polynomial | None:
    """A polynomial with a vector's squares replaced by its square; None: of another form."""
    out: Polynomial = {}
    largest: Polynomial = {}
    for m, c in form.items():
        inner = [n for n in m if n in ball.numbers]
        rest = tuple(n for n in m if n not in ball.numbers)
        if not inner:
            out[rest] = out.get(rest, 0.0) + c
        elif len(inner) == 2 and inner[0] == inner[1] and all(rest.count(n) % 2 == 0 for n in rest):
            largest[rest] = max(largest.get(rest, 0.0), c)
        else:
            return None
    for rest, c in largest.items():
        out[rest] = out.get(rest, 0.0) + c * ball.square
    return out


def _replaced(
    form: Polynomial, number: int, squares: Set[int], total: Polynomial
) -> Polynomial | None:
    """A polynomial with the square of a node replaced by a total less the other squares."""
    replacement = total | {(n, n): -1.0 for n in squares if n != number}
    powers: list[Polynomial] = [{(): 1.0}]
    out: Polynomial = {m: c for m, c in form.items() if m.count(number) < 2}
    for m, c in form.items():
        power = m.count(number) // 2
        if not power:
            continue
        while len(powers) <= power:
            next_power = times(powers[-1], replacement, TERMS)
            if next_power is None:
                return None
            powers.append(next_power)
        index = m.index(number)
        rest = m[:index] + m[index + 2 * power :]
        for n, value in powers[power].items():
            key = tuple(sorted(rest + n))
            out[key] = out.get(key, 0.0) + c * value
    return {m: c for m, c in out.items() if abs(c) > 1e-12}
