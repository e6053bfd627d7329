"""The verdict on each claim of an estimator: proven, checked on the log and by a search, broken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.model.arrays import FloatArray
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.diagnosis import NAMED
from boresight.sim.compare.twin import Traced, made_of
from boresight.sim.compare.verdict import Accuracy
from boresight.sim.fit.observe import Observer
from boresight.sim.ranges.claims import TOLERANCE, Claim, Examined, Witness, claims_of, examine


@dataclass(frozen=True, eq=False)
class ClaimResult:
    """A claim and what is known about it."""

    reason: str  #: the author's.
    line: str  #: where it is stated.
    low: float
    high: float
    state: str  #: name of the state whose range it is, or empty.
    #: "proven" by intervals; "checked" on the log and in the search; "excepted" where a claim with
    #: ``unless`` is left; "left" where the search takes a state out of its range; "broken".
    status: str
    log: tuple[float, float] | None  #: extremes of the value on the log.
    search: tuple[float, float] | None  #: and in the search.
    share: float  #: the farther of both, as a share of the range.
    witness: Witness | None = field(default=None, repr=False)  #: inputs that leave the range.
    #: No word holds the value, since the compiler decided with the claim all that the value enters;
    #: then ``log`` is of float64.
    folded: bool = False
    unless: str = ""  #: the exception that its author names.
    sources: tuple[str, ...] = ()  #: what moves a state out of its range: inputs, parameters.

    @property
    def text(self) -> str:
        """The claim in words, with the author's line."""
        return f"{self.reason} ({self.line})" if self.line else self.reason

    @property
    def failure(self) -> str:
        """What is wrong, where the search or float64 breaks the claim; else empty."""
        if self.status == "broken" and self.folded:
            return (
                f"{self.line}: {self._reached:.6g} in float64 is BEYOND the stated range "
                f"[{self.low:g}, {self.high:g}], {self.reason}, which decides comparisons: widen it"
            )
        if self.status != "broken" or self.witness is None:
            return ""
        return (
            f"stated range [{self.low:g}, {self.high:g}], {self.text}, is BROKEN: "
            f"{self._reached:.6g} in {self.witness}; widen it, limit the value, or use unless"
        )

    @property
    def _reached(self) -> float:
        """How far beyond the range the search came, or float64."""
        ends = self.log if self.folded else self.search
        assert ends is not None
        return max(ends, key=lambda x: max(self.low - x, x - self.high))

    def note(self) -> str:
        """A state that legal inputs take out of its range, which is no fault on this log."""
        where = f" ({self.line})" if self.line else ""
        movers = " and ".join(self.sources)
        movers = f"{movers} within their ranges" if movers else "the step alone"
        return (
            f"{movers} can take {self.state} out of its range{where}: to "
            f"{self._reached:.4g}, beyond [{self.low:g}, {self.high:g}]; widen it, or limit "
            f"{self.state} in the step"
        )

    def to_json(self) -> dict[str, Any]:
        return {**vars(self), "witness": None if self.witness is None else vars(self.witness)}


def claim_results(
    program: Program, examined: Sequence[Examined], accuracy: Accuracy
) -> list[ClaimResult]:
    """Join what the search and the log say."""
    results = []
    for k, e in enumerate(examined):
        claim, search, log = e.claim, e.reach, accuracy.reached[k]
        status = "proven" if e.proven else "checked"
        if k in accuracy.broken:
            status = "broken"
        elif e.witness is not None:
            status = "excepted" if claim.unless else "broken" if claim.bounded else "left"
        share = max((claim.share(*ends) for ends in (log, search) if ends is not None), default=0.0)
        stated = claim.reason, claim.line, claim.low, claim.high, claim.state
        witness = None if k in accuracy.broken else e.witness
        sources = _sources(program, claim, witness) if status == "left" else ()
        reached = status, log, search, share, witness
        results.append(ClaimResult(*stated, *reached, unless=claim.unless, sources=sources))
    return results


def unproven(of: Traced) -> tuple[list[str], list[str]]:
    """Without a log: a line about claims that intervals do not prove; some that are broken.

    A short search looks for these. The line leaves out the ranges of states, as `claim_lines` does.
    """
    examined = examine(of, updates=4)
    proven = [e.proven for e in examined if not e.claim.state]
    text = f"stated ranges: {sum(proven)} of {len(proven)} proven by interval arithmetic; "
    text += "boresight check compares the others with a log"
    broken = [
        ClaimResult(
            c.reason, c.line, c.low, c.high, c.state, "broken", None, e.reach, 1.0, e.witness
        )
        for e in examined
        if e.witness is not None and (c := e.claim).bounded and not c.unless
    ]
    return [text] * (not all(proven)), [claim.failure for claim in broken[:NAMED]]


def _sources(program: Program, claim: Claim, witness: Witness | None) -> tuple[str, ...]:
    """What takes a value out of its range: inputs, parameters that are not at their defaults."""
    words = [] if claim.word is None else [claim.word]
    needed = [program.values[n] for n in made_of(program, words)]
    params = {} if witness is None else witness.params
    inputs = any(value.kind is Kind.INPUT for value in needed)
    given = any(value.kind is Kind.PARAM and value.name in params for value in needed)
    return ("inputs",) * inputs + ("parameters",) * given


class FoldedClaims:
    """Claims whose values no word holds: the compiler decided with them all that they enter.

    They are compared with float64 on the log.
    """

    def __init__(self, of: Traced, params: Mapping[str, float] | None) -> None:
        trace = of.estimator.record()
        held = {(c.line, c.low, c.high) for c in claims_of(of)}
        self._claims = [
            e
            for e in trace.needed
            if e.kind == "bounded"
            and not any(e.data[3:])  # an exception
            and (str(e.line), *map(float, e.data[:2])) not in held
        ]
        self._observer = Observer(trace, of.estimator, params) if self._claims else None

    def add(self, inputs: FloatArray, *, anew: bool = False) -> None:
        """Take the next rows, which perhaps begin from the initial states."""
        if self._observer is not None:
            if anew:
                self._observer.reset()
            self._observer.add(inputs)

    def result(self) -> list[ClaimResult]:
        """Return the claims that float64 breaks."""
        reached = {} if self._observer is None else self._observer.reached
        broken = []
        for e in self._claims:
            low, high, reason, *_ = e.data
            seen, slack = reached.get(e.args[0].number), TOLERANCE * max(abs(low), abs(high))
            if seen is not None and not low - slack <= seen[0] <= seen[1] <= high + slack:
                stated = reason, str(e.line), low, high, ""
                broken.append(ClaimResult(*stated, "broken", seen, None, 1.0, folded=True))
        return broken


def claim_lines(results: Sequence[ClaimResult]) -> list[str]:
    """Summary for people: a line for the claims of `ops.bounded`, some for states out of range."""
    left = sorted((r for r in results if r.status == "left"), key=lambda r: -r.share)
    lines = [r.note() for r in left[:NAMED]]
    if len(left) > NAMED:
        lines[-1] += f"; and {len(left) - NAMED} more: {', '.join(r.state for r in left[NAMED:])}"
    claims = [r for r in results if not r.state]
    if not claims:
        return lines
    counts = Counter(r.status for r in claims)
    text = f"stated ranges: {counts['proven']} of {len(claims)} proven by interval arithmetic"
    checked = [r for r in claims if r.status == "checked"]
    if checked:
        nearest = max(checked, key=lambda r: r.share)
        share = min(nearest.share, 1.0)
        text += f"; {len(checked)} checked, the closest at {share:.0%} of its limit: {nearest.text}"
    if excepted := [r for r in claims if r.status == "excepted"]:
        first, several = excepted[0], len(excepted) > 1
        whose = "their exceptions allow, the first" if several else "its exception allows"
        text += f"; {len(excepted)} exceeded in the search, as {whose}: {first.text}, unless "
        text += first.unless
    return [text, *lines]
