"""Proof that a matrix of states stays a covariance, by vectors whose inner products it is.

A covariance P is P_ij = p_i . p_j of some vectors, |p_i|^2 = P_ii. So is the next P of a filter, in
whatever order it computes the elements, also where several measurements share one pass: of sums
(`sums`), with noise (`noise`), and less the effect of measurements (`measurements`).

The next matrix is a covariance if its elements are the inner products of one vector each; the first
one is, and by induction all are. F and h may be any values of the step. The ranges of elements
follow from the lengths of the vectors (`lengths`). Where one update takes a variance beyond its
declared range, but not beyond the format of its word, the induction lets it be as large as that.

That a value is an inner product is an identity of polynomials, checked at random points, with
selections, limits and functions drawn, too: all points would have to be roots of a false one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.words.fixed import Format
from boresight.model.words.program import Program
from boresight.sim.ranges.cases import ends_in_cases
from boresight.sim.ranges.claims import TOLERANCE, Claim, Premises, Proof, live
from boresight.sim.ranges.coefficients import Coefficient, nodes_behind
from boresight.sim.ranges.inner_products import POINTS, FloatArray, Full, Pair, Space, Vector
from boresight.sim.ranges.lengths import Lengths
from boresight.sim.ranges.pairs import Pairs
from boresight.sim.ranges.points import Points
from boresight.sim.ranges.released import released
from boresight.sim.ranges.steps import covariance_elements, live_nodes
from boresight.sim.ranges.sums import find_vectors
from boresight.sim.ranges.terms import Terms
from boresight.sim.ranges.vectors import Vectors

__all__ = ["ROOM", "Gram"]

#: Decades of the lengths at the points.
_DECADES = 1.0
#: Share of a format that a fitting value leaves free; updates by which variances grow.
ROOM, _ROUNDS = 1e-5, 8
#: Kinds of nodes for whose arguments vectors are found even if they are products or selections.
_READERS = ("bounded", "saturated", "rsqrt", "reciprocal", "select")


class Gram:
    """The vectors of a compiled step; no proofs where the next matrix is not proven a covariance.

    Parameters
    ----------
    estimator, program, nodes
        The last two as `Estimator.compile_traced` gives them.
    vectors : Vectors, optional
        Of the same step.

    Attributes
    ----------
    proven : bool
        Whether the next matrix is a covariance.
    following : list of Vector
        Vectors whose inner products its elements are.
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
        vectors = vectors or Vectors(program, nodes)
        nodes = _with_variances(program, nodes, [elements[i, i][0] for i, j in elements if i == j])
        self.nodes = live_nodes(program, nodes)
        elements = covariance_elements(estimator, program, nodes)
        self.after = {ij: following for ij, (_, following) in elements.items()}
        self.following: list[Vector] = []
        self.size = max(j for _, j in elements) + 1
        self.needed = {n.number for n in live([*self.after.values()])}
        states = {ij: state for ij, (state, _) in elements.items()}
        variances = [states[i, i] for i in range(self.size)]
        rng = np.random.default_rng(1)
        self.space = Space(3 * self.size + 40)
        basis = [self.space.add(_random_vector(v, self.size, rng), variance=v) for v in variances]
        self.space.used = self.size
        self.points = Points(self.nodes, _cone(self.nodes, states.values()), rng)
        self.pairs = Pairs(self.space, self.points)
        for (i, j), node in states.items():
            self.points.let(node, (basis[i].at * basis[j].at).sum(axis=1))
            self.pairs.by_node[node.number] = [(basis[i], basis[j])]
        self.terms = Terms(self.pairs)
        self.lengths = Lengths(
            self.terms,
            vectors,
            ends_in_cases(program, nodes),
            {v.number: v.high for v in variances},
        )
        formats = {nodes[s].number: program.format(s) for s, _ in program.states if s in nodes}
        try:
            self._find()
            self.proven = self._is_covariance()
            if self.proven:
                self.lengths.let(self.lengths.largest)  # with all vectors found
                self._widen(variances, formats)
        except Full:
            return

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from the lengths of vectors."""
        way = self.way(claim, self.lengths.ends) if self.proven else None
        if way is None:
            return None
        pair, rest = way
        premises = self.premises_of(claim.node, rest)
        premises.base |= self.lengths.base_of(pair)
        premises.aliases |= {n for ball in self.lengths.rows_of(pair) for n in ball.aliases}
        return premises.proof("inner products of vectors", self.nodes)

    def way(
        self, claim: Claim, ends: Callable[[Pair, Sequence[Coefficient]], tuple[float, float]]
    ) -> tuple[Pair, Sequence[Coefficient]] | None:
        """A pair and a rest that sum up to the claim's node, with ends within the claim."""
        ways = self.pairs.ways(claim.node) if claim.node.number in self.points.cone else ()
        return next((way for way in ways if claim.holds(*ends(*way))), None)

    def premises_of(self, node: Node, rest: Sequence[Coefficient]) -> Premises:
        """Premises of a proof for a node with a rest, without those of its vectors."""
        numbers = {n.number for n in live([node])}
        aliases = self.points.aliases & (numbers | self.needed)
        return Premises(
            self.points.premises.base | nodes_behind(rest), self.points.premises.aliases | aliases
        )

    def _find(self) -> None:
        """Values and vectors of all nodes, each after its arguments."""
        wanted = {a.number for n in self.nodes.values() if n.kind in _READERS for a in n.args}
        wanted |= {n.number for n in self.after.values()}
        for node in self.nodes.values():
            self.points.evaluate(node, unlimited=self._is_within_limit(node))
            if node.number in self.points.cone:
                find_vectors(self.terms, node, wanted)

    def _is_within_limit(self, node: Node) -> bool:
        """Whether the argument of a limit is an inner product within it."""
        for pair in self.pairs.of(node.args[0]) if node.kind == "saturated" else ():
            lower, upper = self.lengths.ends(pair)
            if -node.value <= lower and upper <= node.value:
                self.points.premises.base |= self.lengths.base_of(pair)
                self.points.premises.aliases.update(
                    *(b.aliases for b in self.lengths.rows_of(pair))
                )
                return True
        return False

    def _is_covariance(self) -> bool:
        """Whether the elements of the next matrix are the inner products of one vector each."""
        roots: list[Vector] = []
        for j in range(self.size):
            vector = next(
                (
                    x
                    for x in self.pairs.roots_of(self.after[j, j])
                    if all(self.pairs.is_product(self.after[i, j], (roots[i], x)) for i in range(j))
                ),
                None,
            )
            if vector is None:
                return False
            roots.append(vector)
        self.following = roots
        return True

    def _widen(self, variances: Sequence[Node], formats: Mapping[int, Format]) -> None:
        """Let variances be as large as an update makes them, where their words hold that."""
        lengths = self.lengths
        limits = {v.number: (1.0 - ROOM) * formats[v.number].max for v in variances}
        for _ in range(_ROUNDS):
            larger = {}
            for i, v in enumerate(variances):
                upper = min(lengths.ends((x, x))[1] for x in self.pairs.roots_of(self.after[i, i]))
                if lengths.largest[v.number] * (1.0 + TOLERANCE) < upper <= limits[v.number]:
                    larger[v.number] = upper
            if not larger:
                return
            lengths.let(lengths.largest | larger)
        lengths.let({v.number: v.high for v in variances})


def _with_variances(
    program: Program, nodes: Mapping[int, Node], variances: Iterable[Node]
) -> Mapping[int, Node]:
    """The nodes, by value, with their intervals where no variance is negative."""
    states = {v.number: (0.0, v.high) for v in variances if v.low < 0.0}
    updated = released(program, nodes, (), states)
    return {value: updated.get(node.number, node) for value, node in nodes.items()}


def _random_vector(variance: Node, size: int, rng: np.random.Generator) -> FloatArray:
    """A vector (points, size) of the previous matrix, no longer than its variance allows."""
    at = rng.normal(size=(POINTS, size))
    at *= math.sqrt(max(variance.high, 0.0)) / np.linalg.norm(at, axis=1, keepdims=True)
    return at * 10.0 ** (-_DECADES * rng.random((POINTS, 1)))


def _cone(nodes: Mapping[int, Node], states: Iterable[Node]) -> set[int]:
    """Numbers of the nodes that depend on states."""
    cone = {node.number for node in states}
    for node in nodes.values():
        if any(a.number in cone for a in node.args):
            cone.add(node.number)
    return cone
