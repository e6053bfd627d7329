"""Proof that a matrix of states stays a covariance, by vectors whose inner products it is.

A covariance P is P_ij = p_i . p_j of some vectors, |p_i|^2 = P_ii. So is what a filter makes of it,
in whatever order it computes the elements, also where several measurements share one pass:

* of F P F^T the vectors are sums, sum_k F_ik p_k;
* noise q of a variance is a new direction, p_i + sqrt(q) e; two variances whose noise has terms
  w a^2 and w b^2 share the direction, if their covariance has noise w a b;
* h P h + v is |m|^2, m = sum_k h_k p_k + sqrt(v) e, and what a measurement takes of each vector is
  its part along the unit vector u = m / |m|: a gain L_i = P_i: h / |m| is p_i . u, and P - L L^T is
  that of p_i - (p_i . u) u, shorter than p_i;
* a selection chooses between vectors: its condition may have either side.

The next matrix is a covariance if its elements are the inner products of one vector each; the first
one is, and by induction all are. F and h may be any values of the step. An inner product is within
the lengths of its two vectors, which follow from the variances of the states, from what conditions
say of them, and from the intervals of F, h, q and v; of a row that is one of several kinds, from
those of each kind (`cases`). Where one update takes a variance beyond its declared range, but not
beyond the format of its word, the induction lets it be as large as that.

That a value is an inner product is an identity of polynomials, checked at random points, with
selections, limits and functions drawn, too: of one that is false all points would have to be roots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from functools import partial

import numpy as np
import numpy.typing as npt

from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import LEAVES, Node
from boresight.model.words.fixed import Format
from boresight.model.words.program import Program
from boresight.sim.ranges.boxes import Ends, Proof
from boresight.sim.ranges.cases import ends_in_cases
from boresight.sim.ranges.claims import TOLERANCE, Claim, live
from boresight.sim.ranges.inner_products import (
    CONDITIONS,
    ONE,
    POINTS,
    Coefficient,
    FloatArray,
    Full,
    Pair,
    Sides,
    Space,
    Term,
    Vector,
    all_sides,
    claim_chain,
    coefficients_of,
    conditions_in,
    flat_parts,
    is_choice,
    is_scaled,
    known_from,
    of_unit,
)
from boresight.sim.ranges.polynomials import Polynomial, polynomial_of, times
from boresight.sim.ranges.steps import covariance_elements, implied, is_possible, live_nodes
from boresight.sim.ranges.unit_vectors import Ball
from boresight.sim.ranges.vectors import Vectors

__all__ = ["ROOM", "Gram", "made_from"]

BoolArray = npt.NDArray[np.bool_]
#: Decades of the lengths at the points.
_DECADES = 1.0
#: Terms of a sum, and of one without inner products, which then stays whole; pairs that are kept of
#: one value.
_TERMS, _LOOSE, _PAIRS = 400, 8, 4
#: Share by which a product of two roots may differ from a covariance of noise: rounding.
_ALIKE = 1e-12
#: Share of a format that is left free by what fits it; updates by which variances grow.
ROOM, _ROUNDS = 1e-5, 8
#: Kinds of nodes for which a product or selection is taken apart.
_READERS = ("bounded", "saturated", "rsqrt", "reciprocal", "select")
#: Kinds of conditions that are made of others.
_CHOICES = ("select", "complement")


class Gram:
    """The vectors of a compiled step; no proofs where the next matrix is not proven a covariance.

    Parameters
    ----------
    estimator, program, nodes
        The last two as `Estimator.compile_traced` gives them.
    vectors : Vectors, optional
        Of the same step.
    """

    def __init__(
        self,
        estimator: Estimator,
        program: Program,
        nodes: Mapping[int, Node],
        vectors: Vectors | None = None,
    ) -> None:
        self.nodes = live_nodes(program, nodes)
        self.proven = False
        elements = covariance_elements(estimator, program, nodes)
        if not elements:
            return
        self.vectors = vectors or Vectors(program, nodes)
        self.rows: dict[tuple[int, ...], tuple[float, Ball]] = {}  # of coefficients
        self.joined: dict[int, Ball] = {}  # of a vector whose length follows from such a row's
        self.cases = ends_in_cases(program, nodes)
        self.varied = {
            n
            for n, (low, high) in self.cases.items()
            if low.max() > self.nodes[n].low or high.min() < self.nodes[n].high
        }
        self.by_case: dict[int, dict[int, Node]] = {}  # what lengths of each case follow from
        self.by_ends: set[int] = set()  # vectors whose lengths follow from others' and intervals
        self.after = {ij: following for ij, (_, following) in elements.items()}
        self.following: list[Vector] = []  # whose inner products the next elements are
        self.size = max(j for _, j in elements) + 1
        self.rng = np.random.default_rng(1)
        self.space = Space(3 * self.size + 40)
        self.values: dict[int, FloatArray] = {}
        self.sizes: dict[int, FloatArray] = {}
        self.signs: dict[int, BoolArray] = {}
        self.found: dict[int, list[Pair]] = {}  # of a node: whose inner products it is
        self.searched: dict[int, int] = {}  # and how many vectors have been tried
        self.sums: dict[int, tuple[list[Pair], tuple[Coefficient, ...]]] = {}
        self.weights: dict[int, tuple[list[Vector], Vector]] = {}
        self.noisy: dict[int, Vector] = {}  # of one without its noise
        self.along: dict[int, dict[int, FloatArray]] = {}  # of one: what noise it has, by direction
        self.noise_of_measurements = set[int]()  # numbers of vectors with it; elements have none
        self.left: dict[int, dict[int, Vector]] = {}  # of one, what measurements leave of it
        self.within: dict[int, Node] = {}  # from which it follows that limits are not reached
        self.passed_within: set[int] = set()
        self.needed = {n.number for n in live([*self.after.values()])}
        self.capped: dict[tuple[int, int], dict[int, float]] = {}
        self.compared: dict[tuple[int, int], tuple[dict[int, float], float]] = {}
        self.lengths: dict[int, float] = {}
        self.apart: dict[int, list[Term] | None] = {}
        self.passed: set[int] = set()
        self.cone: set[int] = set()
        before = {ij: state for ij, (state, _) in elements.items()}
        words = {nodes[s].number: program.format(s) for s, _ in program.states if s in nodes}
        #: Of each variance, by the number of its state: the largest that it has; beyond its
        #: declared range, if one update leads there and not beyond its format.
        self.largest = {before[i, i].number: before[i, i].high for i in range(self.size)}
        try:
            self._find(before)
            self.proven = self._is_covariance()
            if self.proven:
                self._widen([before[i, i] for i in range(self.size)], words)
        except Full:
            return

    def _find(self, before: Mapping[tuple[int, int], Node]) -> None:
        """Values and vectors of all nodes, each after its arguments."""
        self._begin(before)
        wanted = {a.number for n in self.nodes.values() if n.kind in _READERS for a in n.args}
        wanted |= {n.number for n in self.after.values()}
        for number, node in self.nodes.items():
            self._evaluate(node)
            if number in self.cone:
                self._analyse(node, wanted)

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from the lengths of vectors."""
        node = claim.node
        if not self.proven or node.number not in self.cone:
            return None
        for pair, rest in self.ways(node):
            if claim.holds(*self.ends_of(pair, rest)):
                return self.proof_by(node, pair, rest)
        return None

    def ways(self, node: Node) -> Iterator[tuple[Pair, Sequence[Coefficient]]]:
        """Pairs whose inner product, with a rest, a node is."""
        yield from ((pair, ()) for pair in self.pairs_of(node))
        pairs, rest = self.sums.get(node.number, ([], ()))
        yield from ((pair, rest) for pair in pairs)

    def proof_by(self, node: Node, pair: Pair, rest: Sequence[Coefficient] = ()) -> Proof:
        """What it rests on that a node is an inner product, with a rest, of such lengths."""
        base = {n.number: n for c in rest for m in c.nodes for n in known_from(m)}
        base |= self.base_of(pair)
        base |= self.within
        numbers = self.passed_by(node).union(*(b.passed for b in self._rows_of(pair)))
        passed = tuple(self.nodes[n] for n in sorted(numbers))
        return Proof("inner products of vectors", tuple(base.values()), passed)

    def passed_by(self, node: Node) -> set[int]:
        """The "bounded" nodes that count as their arguments in what is known of a node."""
        own = {n.number for n in live([node])}
        return (self.passed & (own | self.needed)) | self.passed_within

    def base_of(self, pair: Pair, *, by_case: bool = True) -> dict[int, Node]:
        """The nodes whose intervals the lengths of vectors follow from.

        ``by_case``: where those of each case tell a length, from no others.
        """
        base: dict[int, Node] = {}
        for v in self._told_by(pair) if by_case else made_from(pair):
            if v.variance is not None and self._is_declared(v.variance):
                base[v.variance.number] = v.variance
            parts = () if by_case and self._is_by_case(v) else v.parts
            base |= {n.number: n for c, _ in parts for m in c.nodes for n in known_from(m)}
            base |= {n.number: n for c in v.noise for m in c.nodes for n in known_from(m)}
            base |= self.by_case.get(v.number, {})
        base |= {n: self.nodes[n] for ball in self._rows_of(pair) for n in ball.used}
        return base

    def _rows_of(self, pair: Pair) -> list[Ball]:
        """The rows of coefficients whose lengths the lengths of vectors follow from."""
        return [
            self.joined[v.number]
            for v in self._told_by(pair)
            if v.number in self.joined and not self._is_by_case(v)
        ]

    def _is_by_case(self, v: Vector) -> bool:
        """Whether the length of a vector follows from those of each case alone."""
        return v.number in self.by_case and v.number not in self.by_ends

    def _told_by(self, pair: Pair) -> Iterator[Vector]:
        """Vectors from whose lengths those of two follow."""
        return made_from(pair, lambda v: flat_parts(v.parts) if self._is_by_case(v) else v.parts)

    # -- values at the points ---------------------------------------------------------------------

    def _begin(self, elements: Mapping[tuple[int, int], Node]) -> None:
        """Vectors of the matrix before."""
        n = self.size
        own = []
        for i in range(n):
            variance = elements[i, i]
            at = self.rng.normal(size=(POINTS, n))
            at *= math.sqrt(max(variance.high, 0.0)) / np.linalg.norm(at, axis=1, keepdims=True)
            at *= 10.0 ** (-_DECADES * self.rng.random((POINTS, 1)))
            own.append(self.space.add(at, variance=variance))
        self.space.used = n
        for (i, j), node in elements.items():
            self.values[node.number] = (own[i].at * own[j].at).sum(axis=1)
            self.sizes[node.number] = abs(self.values[node.number])
            self.found[node.number] = [(own[i], own[j])]
        before = {node.number for node in elements.values()}
        for node in self.nodes.values():
            if node.number in before or any(a.number in self.cone for a in node.args):
                self.cone.add(node.number)

    def _evaluate(self, node: Node) -> None:
        """Value of a node at the points, and the size of the terms that it is the sum of.

        What limits, functions and conditions give is drawn: no identity rests on it.
        """
        if node.number in self.values:
            return
        args = [self.values[a.number] for a in node.args]
        sizes = [self.sizes[a.number] for a in node.args]
        size: FloatArray | None = None
        if node.kind == "const":
            value = np.full(POINTS, node.value)
        elif node.kind in ("input", "param", "state") and math.isfinite(node.high - node.low):
            value = self.rng.uniform(node.low, node.high, POINTS)
        elif node.kind == "bounded" or (node.kind == "saturated" and self._is_within(node)):
            value, size = args[0], sizes[0]
        elif node.kind == "saturated" and _is_nothing(node.args[0], self.passed):
            value = np.zeros(POINTS)
        elif node.kind == "saturated":
            limited = self.rng.uniform(-node.value, node.value, POINTS)
            free = (self.rng.random(POINTS) < 0.5) & (abs(args[0]) <= node.value)
            value = np.where(free, args[0], limited)
        elif node.kind == "sum":
            value = sum((s * a for s, a in zip(node.signs, args, strict=True)), np.zeros(POINTS))
            size = sum(sizes, np.zeros(POINTS))
        elif node.kind == "mul":
            value, size = args[0] * args[1], sizes[0] * sizes[1]
        elif node.kind in ("select", "flip"):
            sign = self._sign(node.args[0])
            yes, no = (-args[1], args[1]) if node.kind == "flip" else args[1:]
            value, size = np.where(sign, yes, no), np.where(sign, sizes[1], sizes[-1])
            if node.number not in self.cone:
                value = self._in_interval(node, value)
        elif node.kind == "rsqrt":
            value = 1.0 / np.sqrt(np.maximum(abs(args[0]), 1e-300))
        elif node.kind == "reciprocal":
            value = 1.0 / np.where(args[0] == 0.0, 1e-300, args[0])
        else:
            value = self.rng.normal(size=POINTS)
        self.values[node.number] = value
        self.sizes[node.number] = abs(value) if size is None else size

    def _in_interval(self, node: Node, value: FloatArray) -> FloatArray:
        """Values of a selection; others where they take a side that its condition excludes."""
        inside = (node.low <= value) & (value <= node.high)
        if inside.all() or not math.isfinite(node.high - node.low):
            return value
        return np.where(inside, value, self.rng.uniform(node.low, node.high, POINTS))

    def _is_within(self, node: Node) -> bool:
        """Whether what a limit limits is an inner product within it."""
        for pair in self.pairs_of(node.args[0]):
            least, most = self.ends_of(pair)
            if -node.value <= least and most <= node.value:
                self.within |= self.base_of(pair)
                self.passed_within.update(*(ball.passed for ball in self._rows_of(pair)))
                return True
        return False

    def _sign(self, condition: Node) -> BoolArray:
        """Whether a condition is negative, at the points: drawn where it is not made of others."""
        number = condition.number
        if number not in self.signs:
            signs = [self._sign(a) for a in condition.args] if condition.kind in _CHOICES else []
            if condition.kind == "select":
                self.signs[number] = np.where(*signs)
            elif condition.kind == "complement":
                self.signs[number] = signs[0] ^ signs[1]
            elif condition.kind == "const":
                self.signs[number] = np.full(POINTS, condition.value < 0.0)
            elif condition.kind == "input" and condition.low < 0.0 < condition.high:
                self.signs[number] = self.values[number] < 0.0
            else:
                share = self.rng.choice([0.2, 0.5, 0.8], POINTS)
                self.signs[number] = self.rng.random(POINTS) < share
        return self.signs[number]

    def _at(self, c: Coefficient) -> FloatArray:
        """Value of a coefficient at the points."""
        value = np.full(POINTS, c.number)
        for node in c.nodes:
            value = value * self.values[node.number]
        for number, side in c.sides:
            value = np.where(self._sign(self.nodes[number]) == (side == 1), value, 0.0)
        return value

    # -- vectors ----------------------------------------------------------------------------------

    def _sum(self, parts: Sequence[tuple[Coefficient, Vector]]) -> Vector:
        """The sum of vectors times coefficients."""
        at = sum((self._at(c)[:, None] * v.at for c, v in parts), np.zeros((POINTS, 1)))
        return self.space.add(at, parts=tuple(parts))

    def _noisy(self, v: Vector, noise: tuple[Coefficient, ...]) -> Vector | None:
        """A vector and the root of what is not negative, in a direction of its own; None: it is."""
        square = sum((self._at(c) for c in noise), np.zeros(POINTS))
        if (square < 0.0).any() or any(low < 0.0 for low in self._lows(noise)):
            return None
        if not square.any():
            return v
        known = [
            other
            for other in self.space.vectors
            if other.noise == noise and other.parts == ((ONE, v),)
        ]
        if known:
            return known[0]
        at = np.zeros((POINTS, self.space.dimensions))
        at[:, : v.at.shape[1]] = v.at
        along = self._common_noise(v, noise)
        for direction, root in along.items():
            at[:, direction] = root
            square = square - root * root
        at[:, self.space.direction()] = np.sqrt(np.maximum(square, 0.0))
        noisy = self.noisy[v.number] = self.space.add(at, parts=((ONE, v),), noise=noise)
        self.along[noisy.number] = along
        return noisy

    def _common_noise(self, v: Vector, noise: Sequence[Coefficient]) -> dict[int, FloatArray]:
        """Roots of the terms w a^2 of a noise, by the direction that each has, or shares.

        A direction is shared only with what has no part of it: squared lengths add up.
        """
        out: dict[int, FloatArray] = {}
        for root in self._roots(noise):
            shared = (
                (direction, sign * root)
                for other, added in self._added_to(v)
                for direction, its in self.along.get(other, {}).items()
                for sign in (1.0, -1.0)
                if np.allclose(sign * root * its, added, rtol=_ALIKE, atol=0.0)
                if direction not in out and not v.at[:, direction].any()
            )
            direction, root = next(shared, (-1, root))
            out[self.space.direction() if direction < 0 else direction] = root
        return out

    def _added_to(self, v: Vector) -> Iterator[tuple[int, FloatArray]]:
        """Numbers of vectors with noise, and what their inner products with v get besides."""
        for pairs, rest in self.sums.values():
            for x, y in pairs if rest else ():
                other = y if x is v else x
                if other is not v and v in (x, y):
                    number = self.noisy.get(other.number, other).number
                    yield number, sum((self._at(c) for c in rest), np.zeros(POINTS))

    def _roots(self, noise: Sequence[Coefficient]) -> list[FloatArray]:
        """sqrt(w) a of the terms w a^2, if no term of a noise is negative; else none."""
        roots: list[FloatArray] = []
        base: dict[int, Node] = {}
        for c in noise:
            form: Polynomial | None = {(): c.number}
            for node in c.nodes:
                by = polynomial_of(node, _TERMS, _LOOSE, self.vectors.said)
                form = None if form is None or by is None else times(form, by, _TERMS)
            if form is None:
                return []
            chosen = self._at(Coefficient(sides=c.sides))
            for m, factor in form.items():
                once = [self.nodes[n] for n in {*m} if m.count(n) % 2]
                if factor <= 0.0 or any(n.low < 0.0 for n in once):
                    return []
                base |= {n.number: n for n in once}
                twice = [self.values[n] for n in {*m} for _ in range(m.count(n) // 2)]
                if twice:
                    square = factor * math.prod((self.values[n.number] for n in once), start=chosen)
                    roots.append(math.prod(twice, start=np.sqrt(square)))
        self.within |= base if roots else {}
        return roots

    def _lows(self, noise: Sequence[Coefficient]) -> Iterator[float]:
        """Least value of a sum for each side of its conditions."""
        for sides in all_sides({n for c in noise for n, _ in c.sides}):
            yield sum(c.ends(sides)[0] for c in noise)

    def less(self, v: Vector, unit: Vector) -> Vector:
        """A vector less its part along another one; of a ``share`` s: v - b (v . s) s.

        With b = (1 - sqrt(1 - |s|^2)) / |s|^2 all inner products x . y are less by (x . s)(s . y).
        """
        along = np.einsum("ij,ij->i", v.at, unit.at)
        if unit.share:
            square = unit.length * unit.length
            root = np.sqrt(np.maximum(1.0 - square, 0.0))
            along = along / (1.0 + root)
        left = self.space.add(v.at - along[:, None] * unit.at, parts=((ONE, v),), unit=unit)
        if left is not v:
            self.left.setdefault(v.number, {})[left.number] = left
        return left

    def without_noise(self, v: Vector) -> Vector:
        """A vector without its latest noise, before measurements or after."""
        if len(v.parts) != 1 or v.parts[0][0] != ONE or (v.unit is not None and v.unit.share):
            return v
        inner = v.parts[0][1]
        if v.noise or v.unit is None:
            return inner if v.noise else v
        plain = self.without_noise(inner)
        return v if plain is inner else self.less(plain, v.unit)

    def pairs_of(self, node: Node) -> list[Pair]:
        """Vectors whose inner product a node is: of all there are the latest, with all noise."""
        found = self.found.setdefault(node.number, [])
        start = self.searched.get(node.number, 0)
        if node.number in self.cone and start < len(self.space.vectors):
            value, size = self.values[node.number], self.sizes[node.number]
            found[:] = self._latest(value, size, start, found)
            self.searched[node.number] = len(self.space.vectors)
        return found

    def _latest(
        self, value: FloatArray, size: FloatArray, start: int = 0, known: Sequence[Pair] = ()
    ) -> list[Pair]:
        """Pairs whose inner product is a value, the latest first."""
        hidden = self.noise_of_measurements
        new = [
            pair
            for pair in self.space.pairs(value, size, start)
            if not any(v.number in hidden for v in pair)
        ]
        new += (self._without(hidden, pair, value, size) for pair in known)
        out = [*dict.fromkeys(self._whole(pair, value, size) for pair in new)]
        out.sort(key=lambda pair: -pair[0].number - pair[1].number)
        return out[:_PAIRS]

    def _without(self, hidden: Set[int], pair: Pair, value: FloatArray, size: FloatArray) -> Pair:
        """A pair without noise that has turned out to be that of a measurement."""
        x, y = (self.without_noise(v) if v.number in hidden else v for v in pair)
        return (x, y) if self.space.is_pair((x, y), value, size) else pair

    def _whole(self, pair: Pair, value: FloatArray, size: FloatArray) -> Pair:
        """A pair with the noise of its vectors, and after measurements, where that is the same."""
        x, y = (self.noisy.get(v.number, v) for v in pair)
        hidden = self.noise_of_measurements
        x, y = (v if new.number in hidden else new for v, new in zip(pair, (x, y), strict=True))
        x, y = (x, y) if self.space.is_pair((x, y), value, size) else pair
        later: Pair | None = (x, y)
        while later is not None:
            x, y = later
            ways = (
                *((left, y) for left in self.left.get(x.number, {}).values()),
                *((x, left) for left in self.left.get(y.number, {}).values()),
            )
            later = next((way for way in ways if self.space.is_pair(way, value, size)), None)
        return (x, y) if x.number >= y.number else (y, x)

    # -- what the nodes are -----------------------------------------------------------------------

    def _analyse(self, node: Node, wanted: set[int]) -> None:
        """Find the vectors of a node, after its arguments."""
        if node.kind == "rsqrt":
            self._weigh(node)
        elif node.kind == "mul" and any(a.number in self.weights for a in node.args):
            at = next(k for k, a in enumerate(node.args) if a.number in self.weights)
            self._gain(node, node.args[1 - at], *self.weights[node.args[at].number])
        elif node.kind in ("bounded", "saturated"):
            self.pairs_of(node)
            if node.kind == "bounded" and node.args[0].number in self.sums:
                self.sums[node.number] = self.sums[node.args[0].number]
            if node.kind == "bounded":
                self.passed.add(node.number)
        elif (
            node.kind == "sum"
            or (node.kind in ("mul", "select", "flip") and node.number in wanted)
            or self._is_reset(node)
        ):
            self._take_apart(node)

    def _weigh(self, node: Node) -> None:
        """The unit vector along m, of the inverse root of |m|^2."""
        of = node.args[0]
        total = next((x for x, y in self.pairs_of(of) if x is y), None)
        if total is None:
            return
        at = total.at / np.where(total.length > 0.0, total.length, 1.0)[:, None]
        unit = self.space.add(at, measured=total)
        alike = [total, self.without_noise(total)]
        self.weights[node.number] = alike, unit
        while total is not alike[1]:
            self.noise_of_measurements.add(total.number)
            if total.noise:
                break
            total = total.parts[0][1]

    def _gain(self, node: Node, column: Node, alike: Sequence[Vector], unit: Vector) -> None:
        """The inner product with a unit vector, of that with what it is along."""
        for x, y in self.pairs_of(column):
            for one, other in ((x, y), (y, x)):
                along = None
                if other in alike:
                    along = unit
                elif (
                    len(other.parts) == 1
                    and other.unit is None
                    and not other.noise
                    and other.parts[0][1] in alike
                    and is_choice(other.parts[0][0])
                ):
                    along = self._sum(((other.parts[0][0], unit),))
                if along is not None and self.is_product(node, (one, along)):
                    self.found.setdefault(node.number, []).append((one, along))
                    return

    def _is_reset(self, node: Node) -> bool:
        """Whether a node is an inner product where a condition says so, else 0."""
        values = node.args[1:] if node.kind == "select" else ()
        nothing = [n for n in values if n.kind == "const" and n.value == 0.0]
        return len(nothing) == 1 and any(self.pairs_of(n) for n in values)

    def _take_apart(self, node: Node) -> None:
        terms = self.terms_of(node)
        if terms is None:
            return
        rest = tuple(t.coefficient for t in terms if not t.factors)
        linear = [t for t in terms if len(t.factors) == 1]
        products = [t for t in terms if len(t.factors) == 2]
        value = self.values[node.number] - sum((self._at(c) for c in rest), np.zeros(POINTS))
        size = self.sizes[node.number]
        pairs = self._latest(value, size)
        if [t.coefficient.number < 0.0 for t in linear] == [True]:
            return  # of a vector and its negative there is one
        if not pairs and linear:
            pairs = [
                p for p in self._candidates(linear, products) if self.space.is_pair(p, value, size)
            ]
        if not pairs:
            return
        self.sums[node.number] = pairs, rest
        found = self.found.setdefault(node.number, [])
        if not rest:
            found += pairs
        same = (v for pair in pairs if rest for v in self._alike(pair))
        v = next((v for v in same if self.space.is_pair((v, v), value, size)), None)
        noisy = None if v is None else self._noisy(v, rest)
        found += [(noisy, noisy)] if noisy else []

    def _alike(self, pair: Pair) -> Iterator[Vector]:
        """Vectors whose square an inner product may be: one of two, or less of it.

        The other may have no part along some unit vectors: what the first one has does not count.
        """
        units = {v.unit.number: v.unit for v in made_from(pair) if v.unit is not None}
        yield from dict.fromkeys(pair)
        for v in dict.fromkeys(pair):
            chosen = [c for c, _ in v.parts if is_scaled(v) and is_choice(c)]
            inner = v.parts[0][1] if chosen else v
            for number in sorted(units):
                inner = self.less(inner, units[number])
                yield self._sum(((chosen[0], inner),)) if chosen else inner

    def terms_of(self, node: Node) -> list[Term] | None:
        """A node as a sum of coefficients times inner products; None: too many."""
        if not self.values[node.number].any():
            return []
        if node.number not in self.cone:
            by = Coefficient(node.value) if node.kind == "const" else Coefficient(nodes=(node,))
            return [Term(by)]
        if self.pairs_of(node):
            return [Term(ONE, (node,))]
        if node.number not in self.apart:
            self.apart[node.number] = self._made_of(node)
        return self.apart[node.number]

    def _made_of(self, node: Node) -> list[Term] | None:
        """The same of a node's arguments."""
        parts: list[list[Term] | None]
        if node.kind == "sum":
            each = zip(node.args, node.signs, strict=True)
            parts = [_multiplied(self.terms_of(a), Coefficient(s)) for a, s in each]
        elif node.kind == "bounded":
            parts = [self.terms_of(node.args[0])]
        elif node.kind in ("select", "flip"):
            c, sign = node.args[0].number, -1.0 if node.kind == "flip" else 1.0
            yes, no = (Coefficient(s, (), frozenset({(c, k)})) for s, k in ((sign, 1), (1.0, 2)))
            parts = [
                _multiplied(self.terms_of(node.args[1]), yes),
                _multiplied(self.terms_of(node.args[-1]), no),
            ]
        elif node.kind == "mul":
            parts = [self._product(*node.args)]
        else:
            parts = [[]]
        if any(part is None for part in parts):
            return None
        out = [term for part in parts for term in part or ()]
        whole = node.kind == "mul" or len(out) > _LOOSE or not out
        if whole and not any(t.factors for t in out):
            return [Term(Coefficient(nodes=(node,)))]
        return out if len(out) <= _TERMS else None

    def _product(self, a: Node, b: Node) -> list[Term] | None:
        """A product of which one factor, at least, is made of inner products; else none."""
        known = [n.number in self.cone and bool(self.pairs_of(n)) for n in (a, b)]
        if all(known):
            return [Term(ONE, (a, b))]
        if a is b:
            return [Term(Coefficient(nodes=(a, b)))]
        for one, other, is_known in ((a, b, known[0]), (b, a, known[1])):
            if is_known and other.number in self.cone:
                terms = self.terms_of(other) or []
                if [len(t.factors) for t in terms] == [1]:
                    return [Term(terms[0].coefficient, (terms[0].factors[0], one))]
            if is_known or other.number not in self.cone:
                return self._scaled(one, other)
        for one, other in ((a, b), (b, a)):
            parts = self.terms_of(one)
            if parts is None or any(t.factors for t in parts):
                return self._scaled(one, other)
        return []

    def _scaled(self, node: Node, factor: Node) -> list[Term] | None:
        """A node times a factor, each side of it where it is a selection that P decides."""
        if factor.kind == "const":
            return _multiplied(self.terms_of(node), Coefficient(factor.value))
        if factor.kind != "select" or factor.number not in self.cone:
            return _multiplied(self.terms_of(node), Coefficient(nodes=(factor,)))
        out: list[Term] = []
        for side in (1, 2):
            part = self._scaled(node, factor.args[side])
            chosen = frozenset({(factor.args[0].number, side)})
            part = _multiplied(part, Coefficient(sides=chosen))
            if part is None:
                return None
            out += part
        return out

    def _candidates(self, linear: Sequence[Term], products: Sequence[Term]) -> Iterator[Pair]:
        """Pairs that a sum may be the inner product of."""
        taken = self._taken(products)
        if taken is None:
            return
        for x, y in self._common(linear):
            for chosen, unit in taken:
                unit = unit if chosen is None else self._sum(((chosen, unit),))
                x, y = self.less(x, unit), self.less(y, unit)
            yield x, y

    def _common(self, linear: Sequence[Term]) -> Iterator[Pair]:
        """A vector that all terms are inner products with, and the sum of the others."""
        tried: list[Vector] = []
        pairs = [(t.coefficient, self.pairs_of(t.factors[0])) for t in linear]
        for vector in (v for pair in pairs[0][1] for v in pair):
            if vector in tried:
                continue
            tried.append(vector)
            parts: list[tuple[Coefficient, Vector]] = []
            for coefficient, found in pairs:
                others = [y if x is vector else x for x, y in found if vector in (x, y)]
                if not others:
                    break
                parts.append((coefficient, max(others, key=lambda v: v.number)))
            else:
                if len(parts) == 1 and is_choice(parts[0][0]) and parts[0][0].sides:
                    yield self._sum(parts), self._sum(((parts[0][0], vector),))
                plain = [c for c, _ in parts] == [ONE]
                yield parts[0][1] if plain else self._sum(parts), vector
                if len(tried) >= _PAIRS:
                    return

    def _taken(self, products: Sequence[Term]) -> list[tuple[Coefficient | None, Vector]] | None:
        """The unit vectors along which products are taken, in order; None: of another form."""
        out: dict[int, tuple[Coefficient | None, Vector]] = {}
        for term in products:
            a, b = (
                [v for pair in self.pairs_of(f) for v in pair if of_unit(v)] for f in term.factors
            )
            unit = next((v for v in a if v in b), None) or self._share_of(term)
            if unit is None:
                return None
            chosen = Coefficient(1.0, (), term.coefficient.sides)
            out[unit.number] = (chosen if chosen.sides else None), unit
        return [out[n] for n in sorted(out)]

    def _share_of(self, term: Term) -> Vector | None:
        """The root of k, times m, of a product k (x . m)(m . y); None: of another form."""
        first, second = ([v for p in self.pairs_of(f) for v in p] for f in term.factors)
        own = Coefficient(nodes=term.coefficient.nodes)
        ways = [(own, m) for m in first if m in second and own.nodes]
        for some, others in ((first, second), (second, first)):
            ways += [v.parts[0] for v in some if is_scaled(v) and v.parts[0][1] in others]
        for c, m in ways:
            if self._is_share(c, m):
                root = np.sqrt(np.maximum(self._at(c), 0.0))
                return self.space.add(root[:, None] * m.at, measured=m, share=True)
        return None

    def _is_share(self, c: Coefficient, m: Vector) -> bool:
        """Whether a coefficient is w / (w |m|^2 + v), neither w nor v negative."""
        if c.number != 1.0 or c.sides or len(c.nodes) != 1:
            return False
        *limits, node = claim_chain(c.nodes[0])
        factors = node.args if node.kind == "mul" else (node,)
        inverse = [f for f in factors if f.kind == "reciprocal"]
        weights = tuple(f for f in factors if f.kind != "reciprocal")
        if len(inverse) != 1 or any(w.low < 0.0 for w in weights):
            return False
        *more, total = claim_chain(inverse[0].args[0])
        terms = self._made_of(total) or []
        squares = [t for t in terms if t.factors]
        rest = [t.coefficient for t in terms if not t.factors]
        if len(squares) != 1 or min(self._lows(rest)) < 0.0:
            return False
        (square,), by = squares, Coefficient(nodes=weights)
        scaled = next((v for v in self.space.vectors if v.parts == ((by, m),)), None)
        if square.coefficient == by:
            pair = m, m
        elif square.coefficient == ONE and scaled is not None:
            pair = scaled, m
        else:
            return False
        if len(square.factors) != 1 or not self.is_product(square.factors[0], pair):
            return False
        self.passed.update(n.number for n in (*limits, *more) if n.kind == "bounded")
        self.within |= {n.number: n for k in (*rest, by) for n in k.nodes}
        return True

    # -- what follows -----------------------------------------------------------------------------

    def _is_covariance(self) -> bool:
        """Whether the elements of the next matrix are the inner products of one vector each."""
        own: list[Vector] = []
        for j in range(self.size):
            candidates = [x for x, y in self.pairs_of(self.after[j, j]) if x is y]
            chosen = next(
                (
                    x
                    for x in candidates
                    if all(self.is_product(self.after[i, j], (own[i], x)) for i in range(j))
                ),
                None,
            )
            if chosen is None:
                return False
            own.append(chosen)
        self.following = own
        return True

    def _widen(self, variances: Sequence[Node], words: Mapping[int, Format]) -> None:
        """Let variances be as large as an update makes them, where their words hold that."""
        most = {v.number: (1.0 - ROOM) * words[v.number].max for v in variances}
        for _ in range(_ROUNDS):
            larger = {}
            for i, v in enumerate(variances):
                end = min(
                    self.ends_of((x, y))[1] for x, y in self.pairs_of(self.after[i, i]) if x is y
                )
                if self.largest[v.number] * (1.0 + TOLERANCE) < end <= most[v.number]:
                    larger[v.number] = end
            if not larger:
                return
            self.let(self.largest | larger)
        self.let({v.number: v.high for v in variances})

    def let(self, largest: Mapping[int, float]) -> None:
        """Set the largest variances, and forget what followed from others."""
        self.largest, self.lengths, self.joined = dict(largest), {}, {}
        self.by_case, self.by_ends = {}, set()

    def _is_declared(self, variance: Node) -> bool:
        """Whether a variance is within its declared range because its declaration says so."""
        return self.largest[variance.number] <= variance.high

    def is_product(self, node: Node, pair: Pair) -> bool:
        """Whether a node is the inner product of two vectors."""
        return self.space.is_pair(pair, self.values[node.number], self.sizes[node.number])

    def ends_of(self, pair: Pair, rest: Sequence[Coefficient] = ()) -> tuple[float, float]:
        """Ends of an inner product and a rest, over the sides of the conditions."""
        x, y = pair
        most = self.longest(x) * self.longest(y)
        low, high = (0.0 if x is y else -most), most
        if rest:
            conditions = {n for c in rest for n, _ in c.sides}
            ends = [[c.ends(sides) for c in rest] for sides in all_sides(conditions)]
            low += min(sum(a for a, _ in each) for each in ends)
            high += max(sum(b for _, b in each) for each in ends)
        return low, high

    def longest(self, v: Vector) -> float:
        """Largest length of a vector, over the sides of its conditions."""
        if v.number not in self.lengths:
            self.lengths[v.number] = max(
                self._length(v, sides, self._caps(sides), {})
                for sides in all_sides(self._conditions_of(v))
                if is_possible(self.nodes, sides)
            )
        return self.lengths[v.number]

    def _conditions_of(self, v: Vector) -> frozenset[int]:
        """Conditions of the vector's parts, and those that P decides of coefficients, if few."""
        parts = made_from([v])
        nodes = {n for part in parts for c in coefficients_of(part) for n in c.nodes}
        found = {n for node in nodes for n in conditions_in(node) if n in self.cone}
        return v.conditions | found if len(v.conditions | found) <= CONDITIONS else v.conditions

    def _length(
        self, v: Vector, sides: Sides, caps: Mapping[int, float], known: dict[int, float]
    ) -> float:
        """Largest length of a vector."""
        if v.number in known:
            return known[v.number]
        if v.variance is not None:
            most = math.sqrt(max(self.largest[v.variance.number], 0.0))
        elif v.measured is not None:
            most = 1.0
        else:
            by: dict[int, tuple[Vector, list[tuple[float, float]]]] = {}
            for c, part in v.parts:
                by.setdefault(part.number, (part, []))[1].append(c.ends(sides))
            length = partial(self._length, sides=sides, caps=caps, known=known)
            most = 0.0
            for part, ends in by.values():
                low, high = (sum(e) for e in zip(*ends, strict=True))
                size = max(-low, high)
                most += size * length(part) if size else 0.0
            most = min(most, self._joined(v, most, length))
            most = min(most, self._in_cases(v, most, sides, length))
            if v.noise:
                most = math.sqrt(most * most + max(0.0, sum(c.ends(sides)[1] for c in v.noise)))
            if v.unit is not None and (m := self._measured(v.unit, sides)) is not None:
                vector, noise = m
                if any(part is vector for _, part in v.parts) and most > 0.0:
                    most = math.sqrt(most * most * noise / (most * most + noise))
        known[v.number] = min(most, caps.get(v.number, math.inf))
        return known[v.number]

    def _joined(self, v: Vector, most: float, length: Callable[[Vector], float]) -> float:
        """|sum of r_k p_k| <= |r| sqrt(sum of |p_k|^2), where that is less than ``most``.

        ``length``: the largest one of each p_k.
        """
        parts = [*flat_parts(v.parts)]
        if len(parts) < 2 or any(len(c.nodes) != 1 or c.sides for c, _ in parts):
            return math.inf
        row = [c.nodes[0] for c, _ in parts]
        key = tuple(n.number for n in row)
        if len({*key}) < len(key):
            return math.inf
        if key not in self.rows:
            self.rows[key] = self.vectors.square_of(row)
        square, proof_of_row = self.rows[key]
        whole = math.sqrt(square * sum((c.number * length(p)) ** 2 for c, p in parts))
        if whole < most:
            self.joined[v.number] = proof_of_row
        return whole

    def _in_cases(
        self, v: Vector, most: float, sides: Sides, length: Callable[[Vector], float]
    ) -> float:
        """The largest of the lengths in each case, where that is less than ``most``."""
        parts = [*flat_parts(v.parts)]
        if len(parts) < 2 or not any(n.number in self.varied for c, _ in parts for n in c.nodes):
            self.by_ends.add(v.number)
            return math.inf
        said, by = dict(implied(self.nodes, sides)), dict[int, list[Ends]]()
        for c, part in parts:
            by.setdefault(part.number, []).append(c.ends_in(self.cases, said))
        total = np.zeros(1)
        for number, ends in by.items():
            low, high = (sum(e) for e in zip(*ends, strict=True))
            total = total + np.maximum(-low, high) * length(self.space.vectors[number])
        for number, side in said.items():  # cases in which a condition has the other side
            low, high = self.cases[number]
            total = np.where(low >= 0.0 if side == 1 else high < 0.0, 0.0, total)
        largest = float(total.max())
        if largest >= most:
            self.by_ends.add(v.number)
        elif v.number not in self.by_case:
            conditions = [self.nodes[number] for number in said]
            below = live([*conditions, *(n for c, _ in parts for n in c.nodes)])
            self.by_case[v.number] = {n.number: n for n in below if n.kind in LEAVES}
        return largest

    def _measured(self, unit: Vector, sides: Sides) -> tuple[Vector, float] | None:
        """What a unit vector measures, and the largest noise; None: nothing, on these sides."""
        if len(unit.parts) == 1 and unit.measured is None:  # where it is chosen
            c, unit = unit.parts[0]
            if any(sides.get(n) != s for n, s in c.sides):
                return None
        total = unit.measured
        if total is None or not total.noise:
            return None
        return total.parts[0][1], max(0.0, sum(c.ends(sides)[1] for c in total.noise))

    def _caps(self, sides: Sides) -> dict[int, float]:
        """Largest lengths by what conditions say."""
        caps: dict[int, float] = {}
        for said in implied(self.nodes, sides):
            if said not in self.capped:
                self.capped[said] = dict(self._said(*said))
            for number, most in self.capped[said].items():
                caps[number] = min(caps.get(number, math.inf), most)
        return caps

    def _said(self, condition: int, side: int) -> Iterator[tuple[int, float]]:
        """Largest lengths of the vectors whose squares a condition compares with a constant."""
        squares, rest = self._compared(condition, side)
        for number, factor in squares.items():
            yield number, math.sqrt(max(0.0, rest / factor))

    def limits_on(self, sides: Sides) -> Iterator[tuple[dict[int, float], float]]:
        """Factors of squared lengths, by vector, and what their sum is at most on these sides."""
        for said in implied(self.nodes, sides):
            if said not in self.compared:
                self.compared[said] = self._compared(*said)
            if self.compared[said][0]:
                yield self.compared[said]

    def _compared(self, condition: int, side: int) -> tuple[dict[int, float], float]:
        """The same of one condition; no factors where it compares something else."""
        sign = 1.0 if side == 1 else -1.0
        rest, squares, base = 0.0, dict[int, float](), dict[int, Node]()
        for t in self.terms_of(self.nodes[condition]) or ():
            c = t.coefficient
            if not t.factors:
                low, high = c.ends({})
                rest += low if sign > 0.0 else -high
                base |= {n.number: n for m in c.nodes for n in known_from(m, {})}
                continue
            own = [x for x, y in self.pairs_of(t.factors[0]) if x is y]
            if len(t.factors) > 1 or c.nodes or c.sides or not own or sign * c.number <= 0.0:
                return {}, 0.0
            squares |= {x.number: sign * c.number for x in own}
        self.within |= base if squares else {}
        return squares, -rest


def made_from(
    vectors: Sequence[Vector],
    parts: Callable[[Vector], Iterable[tuple[Coefficient, Vector]]] = lambda v: v.parts,
) -> Iterator[Vector]:
    """Vectors and all that they are made from, each once."""
    stack, seen = [*vectors], set[int]()
    while stack:
        v = stack.pop()
        if v.number not in seen:
            seen.add(v.number)
            yield v
            stack += [part for _, part in parts(v)]
            stack += [] if v.unit is None or v.unit.measured is None else [v.unit.measured]


def _is_nothing(node: Node, passed: set[int]) -> bool:
    """Whether a node is 0, as x - (x + c - c) is, but for rounding."""
    own: set[int] = set()
    form = polynomial_of(node, _LOOSE, _LOOSE, (), own)
    nothing = form is not None and not any(form.values())
    passed |= own if nothing else set()
    return nothing


def _multiplied(terms: Sequence[Term] | None, by: Coefficient) -> list[Term] | None:
    """A sum times a coefficient."""
    if terms is None:
        return None
    products = (Term(by.times(t.coefficient), t.factors) for t in terms)
    return [t for t in products if t.coefficient.number]
