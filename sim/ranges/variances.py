"""Proof that variances stay below limits of their own, and of ranges that follow from that.

`sim.ranges.gram` lets each variance be all that its declared range holds. Often it is never that
large: what is added to a variance stops where a condition says that it is at a limit, and one
update adds so much at most. Such limits are proven by induction: they begin as the first variances
and become what an update can make of them until nothing changes. One that grows for some updates
becomes what the next condition says of it. Elements, gains and variances of measurements follow
from such limits as from the ranges.
"""

from __future__ import annotations

from collections.abc import Mapping

from boresight.sim.ranges.claims import Claim, Proof
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.lengths import Lengths
from boresight.sim.ranges.vectors import Vectors

__all__ = ["Variances"]

#: Updates after which the limits have to repeat themselves; after how many those that still grow
#: become what a condition says that they are less than.
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
            first = {n: vectors.first[n] for n in gram.lengths.largest}
            self.lengths = Lengths(gram.terms, vectors, gram.lengths.cases, first)
            self.limits = self._kept(first)

    def proof_of(self, claim: Claim) -> Proof | None:
        """Prove a claim, if it follows from the limits.

        It rests on what the limits rest on: on all that the next matrix is made of.
        """
        gram = self.gram
        way = gram.way(claim, self.lengths.ends) if self.limits else None
        if way is None:
            return None
        pair, rest = way
        rests_on = gram.behind(claim.node, rest)
        for each in (pair, *((v, v) for v in gram.following)):
            rests_on.base |= self.lengths.base_of(each)
            rests_on.passed |= {n for ball in self.lengths.rows_of(each) for n in ball.passed}
        return rests_on.proof("limits of variances", gram.nodes)

    def _kept(self, limits: dict[int, float]) -> dict[int, float]:
        """Limits that follow for the next matrix from themselves; none: there are none."""
        ends = {number: self.gram.nodes[number].high for number in limits}
        said = self._said()
        for k in range(1, _ROUNDS):
            after = self._after(limits)
            if any(after[number] > end for number, end in ends.items()):
                return {}
            growing = {number for number, end in limits.items() if after[number] > end}
            if not growing:
                return limits
            limits = limits | {number: after[number] for number in growing}
            if k % _SLOW == 0:
                above = {n: [e for e in said[n] if after[n] < e <= ends[n]] for n in growing}
                limits |= {number: min(each) for number, each in above.items() if each}
        return {}

    def _after(self, limits: Mapping[int, float]) -> dict[int, float]:
        """The largest next variances."""
        self.lengths.let(dict(limits))
        return {
            v.variance.number: self.lengths.longest(following) ** 2
            for v, following in zip(self.gram.space.vectors, self.gram.following, strict=False)
            if v.variance is not None
        }

    def _said(self) -> dict[int, list[float]]:
        """What conditions say that variances are less than."""
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
