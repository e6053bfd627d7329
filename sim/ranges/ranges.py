"""Every claim of an estimator about its ranges, with what is known of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from boresight.model.estimator import Estimator
from boresight.model.words.program import Overflow
from boresight.sim.answer import Answer, Figure
from boresight.sim.ranges.boxes import proof_of
from boresight.sim.ranges.claims import Claim, claims_of
from boresight.sim.ranges.covariances import of_covariance
from boresight.sim.ranges.search import Reach, Search

__all__ = ["NEAR", "STATUSES", "ClaimResult", "RangesResult", "Witness", "examine"]

#: What is known of a claim, the best first.
STATUSES = ("proven", "theorem", "tight", "open", "refuted")
#: Share of a range's size from which on a witness shows it to be tight.
NEAR = 0.9


@dataclass(frozen=True)
class Witness:
    """Legal parameters and inputs that take a value where it came.

    Attributes
    ----------
    params : dict of str to float
    inputs : dict of str to list of float
        One number for each update from a reset on, by input.
    """

    params: dict[str, float]
    inputs: dict[str, list[float]] = field(repr=False)

    @property
    def updates(self) -> int:
        """Updates from the reset on."""
        return len(next(iter(self.inputs.values())))

    @property
    def last(self) -> str:
        """The last update's inputs."""
        return ", ".join(f"{name} = {values[-1]:.6g}" for name, values in self.inputs.items())


@dataclass(frozen=True)
class ClaimResult:
    """A claim and what is known of it.

    Attributes
    ----------
    value : str
        The reason that its author gives, or which state it is.
    line : str
        Where it is stated.
    low, high : float
        The range.
    status : str
        One of `STATUSES`.
    how : str
        Of what is proven: how.
    least, most : float or None
        What the search reached; None: it did not run.
    share : float
        Largest magnitude reached, as a share of the range's.
    witness : Witness or None
        Of a refuted claim.
    """

    value: str
    line: str
    low: float
    high: float
    status: str
    how: str
    least: float
    most: float
    share: float
    witness: Witness | None = None

    def __str__(self) -> str:
        where = f"{self.value} ({self.line})" if self.line else self.value
        text = f"{self.status:8} [{self.low:g}, {self.high:g}] {where}"
        text += f": {self.how}" if self.how else f": reached [{self.least:.6g}, {self.most:.6g}]"
        if self.witness is not None:
            text += f", in update {self.witness.updates} after a reset, {self.witness.last}"
            changed = ", ".join(f"{k} = {v:.6g}" for k, v in self.witness.params.items())
            text += f"; parameters {changed}" if changed else ""
        return text


@dataclass(frozen=True, eq=False)
class RangesResult(Answer):
    """What `boresight.ranges` gives.

    Attributes
    ----------
    estimator : str
    word : int
    claims : tuple of ClaimResult
        Of values; states are apart.
    states : tuple of ClaimResult
        That next states are in their ranges: proven is an invariant, else it is what was observed.
    updates : int
        Of the search.
    saturated : dict of str to int
        Words that saturated in the search, with how often.
    """

    judged: ClassVar[Mapping[str, Figure]] = {
        "shown": Figure("claims proven or tight, share", "count", falls=True),
        "refuted": Figure("claims refuted", "count"),
    }

    estimator: str
    word: int
    claims: tuple[ClaimResult, ...]
    states: tuple[ClaimResult, ...]
    updates: int
    saturated: dict[str, int]

    @property
    def good(self) -> bool:
        """Nothing is refuted."""
        return not self.refuted

    @property
    def refuted(self) -> int:
        """Number of refuted claims, of values and states."""
        return sum(c.status == "refuted" for c in (*self.claims, *self.states))

    @property
    def shown(self) -> float:
        """Share of the claims about values that are proven, by theorem, or tight."""
        good = sum(c.status in STATUSES[:3] for c in self.claims)
        return good / len(self.claims) if self.claims else 1.0

    def to_json(self) -> dict:  # type: ignore[type-arg]
        """Return the fields, ``good``, ``shown`` and ``refuted`` as plain data."""
        head = {"good": self.good, "shown": self.shown, "refuted": self.refuted}
        return {**head, **super().to_json()}

    def __str__(self) -> str:
        lines = [f"{self.estimator}, W = {self.word}: {self.updates:,} updates"]
        for title, claims in (("claims", self.claims), ("next states", self.states)):
            count = Counter(c.status for c in claims)
            each = ", ".join(f"{count[s]} {s}" for s in STATUSES if count[s])
            lines.append(f"  {len(claims)} {title}: {each or 'none'}")
        shown = [c for c in (*self.claims, *self.states) if c.status in ("open", "refuted")]
        lines += [f"  {c}" for c in sorted(shown, key=lambda c: -STATUSES.index(c.status))]
        if self.saturated:
            words = ", ".join(f"{name} {count:,}x" for name, count in self.saturated.items())
            lines.append(f"  saturated: {words}")
        lines.append("good" if self.good else f"BAD: {self.refuted} refuted")
        return "\n".join(lines)


def examine(
    estimator: Estimator,
    *,
    word: int = 32,
    updates: int = 200,
    seed: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> RangesResult:
    """Prove, or search.

    Parameters
    ----------
    updates : int
        Of each of the runs of the search.
    """
    program, nodes = estimator.compile_traced(word=word)
    claims = claims_of(program, nodes)
    proofs: list[str | None] = []
    for k, claim in enumerate(claims):
        progress(f"claim {k + 1} of {len(claims)}")
        proofs.append(proof_of(claim))
    search = Search(estimator, program, nodes, claims, seed)
    search.run(updates, progress)
    reached = search.reach()
    rest = [
        k
        for k, (claim, reach) in enumerate(zip(claims, reached, strict=True))
        if proofs[k] is None and not reach.broken and _share(claim, reach) < NEAR
    ]
    theorems = of_covariance(
        estimator, program, nodes, [claims[k] for k in rest], max(1, updates // 4)
    )
    theorem = {rest[k]: how for k, how in theorems.items()}
    names = [i.name for i in estimator.inputs]
    results = []
    for k, (claim, reach, proof) in enumerate(zip(claims, reached, proofs, strict=True)):
        share = _share(claim, reach)
        how = proof or theorem.get(k, "")
        if reach.broken:
            status = "refuted"
        elif how:
            status = "proven" if proof else "theorem"
        else:
            status = "tight" if share >= NEAR else "open"
        witness = None
        if reach.broken:
            params, rows = search.path(reach)
            witness = Witness(params, dict(zip(names, rows.T.tolist(), strict=True)))
        results.append(
            ClaimResult(
                claim.reason,
                claim.line,
                claim.low,
                claim.high,
                status,
                "" if reach.broken else how,
                reach.least,
                reach.most,
                share,
                witness,
            )
        )
    clamping = {op.dest for op in program.ops if op.overflow is Overflow.SAT}
    counts = search.machine.saturations
    return RangesResult(
        estimator=estimator.name,
        word=word,
        claims=tuple(r for r, c in zip(results, claims, strict=True) if not c.state),
        states=tuple(r for r, c in zip(results, claims, strict=True) if c.state),
        updates=updates * search.machine.runs,
        saturated={
            program.values[n].name: int(counts[n])
            for n in np.flatnonzero(counts).tolist()
            if n in clamping
        },
    )


def _share(claim: Claim, reach: Reach) -> float:
    return max(-reach.least, reach.most) / claim.size if claim.size else 1.0
