"""Proof that variances stay below limits of their own, and of ranges that follow from that.

`sim.ranges.gram` lets each variance be as large as its declared range. Often it is never that
large: noise is added only until a condition finds the variance at a limit, and only so much by one
update. Such limits are proven by induction: they begin as the first variances and grow to the
largest ones after an update until nothing changes. A limit that grows for several updates is raised
to the next level of a condition. Elements, gains and variances of measurements follow from such
limits as from the ranges.
"""

from __future__ import annotations

from collections.abc import Mapping

from boresight.sim.ranges.claims import Claim, Proof
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.lengths import Lengths
from boresight.sim.ranges.vectors import Vectors

__all__ = ["Variances"]

#: Updates after which the limits have to be constant; updates after which those that still grow are
#: raised to a level of a condition.
_ROUNDS, _SLOW = 40, 4


class Variances:
    """Limits of the variances of a compiled step; no proofs where there are none.

    Parameters
    ----------
    gram : Gram
        Of the same step.
    vectors : Vectors
        Of the same step.

    Attributes
    ----------
    limits : dict of int to float
        The largest that each variance is, by the number of its state.
    """

    def __init__(self, gram: Gram, vectors: Vectors) -> None:
        self.gram = gram
        self.limits: dict[int, float] = {}
        if gram.proven:
            initial = {n: vectors.first[n] for n in gram.lengths.largest}
            self.lengths = Lengths(gram.terms, vectors, gram.lengths.cases, initial)
            self.limits = self._invariant_limits(initial)

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from the limits.

        Its premises include those of the limits: all parts of the next matrix.
        """
        gram = self.gram
        way = gram.way(claim, self.lengths.ends) if self.limits else None
        if way is None:
            return None
        pair, rest = way
        premises = gram.premises_of(claim.node, rest)
        for vectors in (pair, *((v, v) for v in gram.following)):
            premises.base |= self.lengths.base_of(vectors)
            premises.aliases |= {n for ball in self.lengths.rows_of(vectors) for n in ball.aliases}
        return premises.proof("limits of variances", gram.nodes)

    def _invariant_limits(self, limits: dict[int, float]) -> dict[int, float]:
        """Limits that an update keeps, from these on; empty if there are none."""
        ends = {number: self.gram.nodes[number].high for number in limits}
        levels = self._levels()
        for k in range(1, _ROUNDS):
            following = self._next_variances(limits)
            if any(following[number] > end for number, end in ends.items()):
                return {}
            growing = {number for number, end in limits.items() if following[number] > end}
            if not growing:
                return limits
            limits = limits | {number: following[number] for number in growing}
            if k % _SLOW == 0:
                above = {n: [e for e in levels[n] if following[n] < e <= ends[n]] for n in growing}
                limits |= {number: min(values) for number, values in above.items() if values}
        return {}

    def _next_variances(self, limits: Mapping[int, float]) -> dict[int, float]:
        """The largest next variances."""
        self.lengths.let(dict(limits))
        return {
            v.variance.number: self.lengths.longest(following) ** 2
            for v, following in zip(self.gram.space.vectors, self.gram.following, strict=False)
            if v.variance is not None
        }

    def _levels(self) -> dict[int, list[float]]:
        """Levels that conditions compare variances with."""
        gram = self.gram
        out: dict[int, list[float]] = {number: [] for number in gram.lengths.largest}
        for condition in sorted({n for v in gram.following for n in v.conditions}):
            for side in (1, 2):
                for squares, rest in gram.terms.limits_on({condition: side}):
                    for n, factor in squares.items():
                        variance = gram.space.vectors[n].variance
                        if variance is not None:
                            out[variance.number].append(rest / factor)
        return out
