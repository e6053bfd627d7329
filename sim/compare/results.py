"""What a check found: a verdict for each level and claim, and all for one estimator on one record.

A claim is proven, checked on the log and by a search, or broken.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.estimator import WAIVED
from boresight.model.lowering.profile import Profile
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.diagnosis import NAMED
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.textbook import Book
from boresight.sim.compare.twin import Traced, made_of
from boresight.sim.compare.verdict import Accuracy
from boresight.sim.fit.observe import Observer
from boresight.sim.levels.build import Build, Level, Run
from boresight.sim.ranges.claims import TOLERANCE, Claim, Examined, Witness, claims_of, examine
from boresight.sim.records.feed import Feed
from boresight.sim.result import JsonObject, plain


@dataclass
class LevelResult:
    """One level's verdict: words, flags, states if it shows them, and cycles if it has a clock.

    ``n_mismatch`` counts the updates, of ``n_total``, whose outputs, states or flags differ, and
    ``first_wrong`` is the first of them. ``error`` says why a level did not run, or why its run
    proves nothing: then there are no counts (None). Cycles are None for levels without a clock.
    ``reference`` marks the interpreter, with which the others are compared.
    """

    level: str
    simulator: str
    n_total: int | None = 0
    n_mismatch: int | None = 0
    seconds: float = 0.0
    cycles_predicted: int | None = None
    cycles_min: int | None = None
    cycles_max: int | None = None
    interval_predicted: int | None = None
    interval_min: int | None = None
    interval_max: int | None = None
    error: str = ""
    divergence: str = ""
    first_wrong: int | None = None
    reference: bool = False

    def add(self, level: Level, run: Run, wanted: Run, start: int) -> None:
        """Count the rows from ``start`` on; ``wanted`` are the interpreter's, or more."""
        self.error = self.error or run.fault
        found = _columns(run, run)
        if not len(found):
            return
        expected = _columns(wanted, run)[: len(found)]
        if (plan := level.schedule) is not None:
            assert run.latency_cycles is not None and run.interval_cycles is not None
            self._count("cycles", plan.latency, run.latency_cycles[:, : plan.urgent].max(axis=1))
            self._count("interval", plan.interval, run.interval_cycles)
        wrong = found != expected
        rows = wrong.any(axis=1)
        self.n_total = (self.n_total or 0) + len(rows)
        self.n_mismatch = (self.n_mismatch or 0) + int(rows.sum())
        if self.first_wrong is None and rows.any():
            row = int(np.argmax(rows))
            column, program = int(np.argmax(wrong[row])), level.program
            self.first_wrong = start + row
            states = (f"state {program.values[state].name}" for state, _ in program.states)
            names = [*program.output_names, "its saturation flag", "its range flag", *states]
            self.divergence = (
                f"{self.level}: first difference in {names[column]}, step {self.first_wrong}: "
                f"wanted {expected[row, column]}, found {found[row, column]}"
            )

    def _count(self, name: str, predicted: int, counted: IntArray) -> None:
        seen = [int(counted.min()), int(counted.max())]
        earlier = (getattr(self, f"{name}_{end}") for end in ("min", "max"))
        seen += [cycles for cycles in earlier if cycles is not None]
        setattr(self, f"{name}_predicted", predicted)
        setattr(self, f"{name}_min", min(seen))
        setattr(self, f"{name}_max", max(seen))

    def ended(self, seconds: float, error: str) -> LevelResult:
        """The verdict after so much time, with the level's error if it has one."""
        error = error or self.error
        counts = (None, None) if error else (self.n_total, self.n_mismatch)
        return dataclasses.replace(
            self, seconds=seconds, error=error, n_total=counts[0], n_mismatch=counts[1]
        )

    @property
    def good(self) -> bool:
        """Ran, compared something, and found no difference in words or cycles."""
        return not self.failure

    @property
    def failure(self) -> str:
        """Why it failed; empty where it did not."""
        if self.error:
            return self.error
        if not self.n_total:
            return "no update was compared"
        if self.n_mismatch:
            return f"{self.n_mismatch} of {self.n_total} updates differ"
        if not self.cycles_min == self.cycles_predicted == self.cycles_max:
            return self._counted("cycles")
        if not self.interval_min == self.interval_predicted == self.interval_max:
            return self._counted("interval")
        return ""

    def _counted(self, name: str) -> str:
        predicted, low, high = (getattr(self, f"{name}_{x}") for x in ("predicted", "min", "max"))
        counted = f"{low}" if low == high else f"{low}..{high}"
        return f"{name} predicted {predicted}, counted {counted}"

    def to_json(self) -> dict[str, Any]:
        return {**dataclasses.asdict(self), "good": self.good, "failure": self.failure}

    def line(self) -> str:
        """One line for people; what `error` says stands in the verdict, once for all levels."""
        name = f"{self.level:8s} {self.simulator:12s}"
        if self.error:
            return f"{name} FAILED"
        text = f"{name} [{self.n_mismatch}/{self.n_total}] mismatches"
        if self.reference:
            text = f"{name} reference, {self.n_total} updates"
        if self.cycles_predicted is not None:
            text += f"   {self._counted('cycles')}; {self._counted('interval')}"
        return f"{text}   {self.seconds:.1f} s" + (
            f"\n         {self.divergence}" if self.divergence else ""
        )


def _columns(run: Run, shown: Run) -> IntArray:
    """Output words, flags and, if the level shows them, states: (n, columns)."""
    assert run.words is not None and run.saturated is not None and run.beyond is not None
    columns = [run.words, run.saturated, run.beyond]
    if shown.states is not None:
        assert run.states is not None
        columns.append(run.states)
    return np.column_stack(columns)


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


class Part(NamedTuple):
    """Rows of a log: what an estimator ran on, fixed point and float64."""

    given: Feed
    fixed: Run
    floating: Run


@dataclass(frozen=True, eq=False)
class CheckResult:
    """All levels on one record, and the float comparison that goes with them."""

    build: Build = field(repr=False)
    number: int  #: which of its estimators was checked.
    #: What it ran on; of a long log, as `fixed` and `floating`, the leading rows
    #: (`sim.compare.check.KEPT`).
    given: Feed = field(repr=False)
    levels: tuple[LevelResult, ...]
    accuracy: Accuracy
    fixed: Run = field(repr=False)  #: the interpreter's, with which every level was compared.
    floating: Run = field(repr=False)
    book: Book = field(default_factory=Book)  #: float64 beside `Estimator.textbook`.
    truth: tuple[Difference, ...] = ()  #: errors of fixed point against the log's true values.
    comparison: bool = False  #: these are another device's estimates: then limits do not count.
    claims: Sequence[ClaimResult] = ()  #: of `ops.bounded`, and the ranges of states.
    rows: int = 0  #: of the log.
    #: All rows of the log, piece by piece: what it ran on, fixed point and float64. Of a long log
    #: they run again, fixed point in C.
    parts: Callable[[], Iterator[Part]] = field(default=lambda: iter(()), repr=False)

    @property
    def estimator(self) -> str:
        return self.build.estimators[self.number].name

    @property
    def identity(self) -> str:
        """That of the core (`gateware.core.Core.identity`); empty if none holds the programs."""
        return "" if self.build.shortage else self.build.core.identity

    @property
    def textbook(self) -> tuple[Difference, ...]:
        return self.book.differences

    @property
    def profile(self) -> Profile | None:
        return self.build.estimators[self.number].profile

    @property
    def failures(self) -> list[str]:
        """What is wrong, one line each; empty if `good`."""
        levels = [f"{x.level} in {x.simulator}: {x.failure}" for x in self.levels if x.failure]
        book = [] if self.book.good else [self.book.line()]
        none = [] if self.levels else ["no form was run"]
        claims = [claim.failure for claim in self.claims if claim.failure]
        wrong = [f"against truth: {e.line()}" for e in self.truth if not e.good]
        # What is wrong in the model is the cause of the others.
        model = [*self.book.faults, *self.accuracy.faults()]
        return [*levels, *model, *claims, *book, *([] if self.comparison else wrong), *none]

    @property
    def exact(self) -> bool | None:
        """Every level ran and equals the integer model; None if no level was compared with it."""
        if not all(level.good for level in self.levels):
            return False
        return True if any(not level.reference for level in self.levels) else None

    @property
    def good(self) -> bool:
        """Nothing failed: levels, accuracy, claims and the textbook form."""
        return not self.failures

    def lines(self) -> list[str]:
        reference = "a comparison" if self.comparison else "truth"
        return [
            f"{self.estimator} on {self.given.record.name}, {self.build.config}, "
            f"W = {self.build.word}{', core ' * bool(self.identity)}{self.identity}",
            *(f"  {level.line()}" for level in self.levels),
            *([] if self.profile is None else [f"  {self.profile}"]),
            *(f"  {text}" for text in self.accuracy.lines()),
            *(f"  against {reference}: {e.line()}" for e in self.truth),
            *([f"  {self.book.line()}"] if self.textbook else []),
            *(f"  {text}" for text in self.book.gates),
            *(f"  model: {text}" for text in self.book.faults),
            *(f"  {text}" for text in claim_lines(self.claims)),
            *(f"  {claim.failure}" for claim in self.claims if claim.failure),
            *(f"  warning: {text}" for text in self.given.warnings),
        ]

    def __str__(self) -> str:
        return "\n".join((*self.lines(), verdict([self])))

    def to_json(self) -> JsonObject:
        return {
            "estimator": self.estimator,
            "log": self.given.record.name,
            "config": self.build.config,
            "word": self.build.word,
            "program": self.build.programs[self.number].digest,
            "identity": self.identity,
            "parameters": plain(self.build.values[self.number]),
            "profile": None if self.profile is None else self.profile.place,
            "good": self.good,
            "exact": self.exact,
            "accuracy": plain(self.accuracy),
            "truth": [e.to_json() for e in self.truth],
            "textbook": [d.to_json() for d in self.textbook],
            "waived": {kind: kind in self.build.estimators[self.number].waived for kind in WAIVED},
            "model_faults": list(self.book.faults),
            "claims": [claim.to_json() for claim in self.claims],
            "warnings": list(self.given.warnings),
            "verification": [x.to_json() for x in self.levels],
        }


def verdict(results: Sequence[CheckResult]) -> str:
    """``good``, or ``FAILED`` with the first failure of each result; what they share, once."""
    names: dict[str, list[str]] = {}
    for result in results:
        for text in result.failures[:1]:
            name = f"{result.estimator} on {result.given.record.name}"
            names.setdefault(" ".join(text.split()), []).append(name)
    if not names:
        return "good"
    shared = [text for text, where in names.items() if len(where) == len(results)]
    own = [f"{', '.join(where)}: {text}" for text, where in names.items() if text not in shared]
    return f"FAILED: {'; '.join(shared + own)}"
