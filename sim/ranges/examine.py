"""What is known about the claims of an estimator before any log: proofs, and a search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program
from boresight.sim.ranges.boxes import is_proven
from boresight.sim.ranges.claims import Claim, claims_of, live
from boresight.sim.ranges.search import Reach, Search, Witness

#: Operations that the search runs by default, each on all runs: about half a second. A claim takes
#: as long as so many operations.
WORK, CLAIM = 20_000, 6
#: Fewest and most updates of each run.
FEWEST, MOST = 8, 400


@dataclass(frozen=True, eq=False)
class Examined:
    """A claim, with what a proof or a search says about it."""

    claim: Claim
    #: By intervals, without any claim that is not proven; then nothing was searched.
    proven: bool
    #: How far the search came.
    reach: Reach | None = None
    #: Inputs that break the claim.
    witness: Witness | None = None


def examine(
    estimator: Estimator,
    program: Program,
    nodes: Mapping[int, Node],
    *,
    updates: int | None = None,
    seed: int = 1,
) -> list[Examined]:
    """Prove each claim by intervals, or search for inputs that break it.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    updates : int, optional
        Updates of each of the `RUNS` runs; by default as many as take about half a second.
    """
    claims = claims_of(program, nodes)
    proven = _proven(claims)
    tried = [claim for claim in claims if claim not in proven]
    if not tried:
        return [Examined(claim, proven=True) for claim in claims]
    if updates is None:
        cost = len(program.ops) + CLAIM * len(tried)
        updates = min(max(WORK // cost, FEWEST), MOST)
    search = Search(estimator, program, nodes, tried, seed)
    search.run(updates)
    found = {}
    for claim, reach in zip(tried, search.reach(), strict=True):
        witness = search.witness(reach) if reach.broken else None
        found[claim] = Examined(claim, False, reach, witness)
    return [found.get(claim, Examined(claim, proven=True)) for claim in claims]


def _proven(claims: Sequence[Claim]) -> set[Claim]:
    """Claims that follow from intervals, and from no claim that is not among them."""
    by_node = {(c.node.number, c.low, c.high): c for c in claims if not c.state}
    proven: set[Claim] = set()
    for claim in claims:  # in the order of computation
        needed = [
            by_node[key]
            for node in live([claim.node])
            if node.kind == "bounded"
            and (key := (node.args[0].number, node.low, node.high)) in by_node
        ]
        if proven.issuperset(needed) and is_proven(claim):
            proven.add(claim)
    return proven
