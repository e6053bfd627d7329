"""Status of every claim of an estimator about its ranges."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import ClassVar

import numpy as np

from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.words.fixed import Format
from boresight.model.words.program import Overflow, Program
from boresight.sim.answer import Answer, Figure, JsonObject, plain
from boresight.sim.ranges.boxes import proof_of, reached_cells
from boresight.sim.ranges.claims import Assumptions, Claim, Proof, claims_of
from boresight.sim.ranges.covariances import check_on_covariances
from boresight.sim.ranges.gram import ROOM, Gram
from boresight.sim.ranges.intervals import ends_in_order, interval_needs, proof_in_order
from boresight.sim.ranges.norms import Norms
from boresight.sim.ranges.released import released
from boresight.sim.ranges.search import RUNS, Reach, Search
from boresight.sim.ranges.steps import live_nodes
from boresight.sim.ranges.traces import Traces
from boresight.sim.ranges.variances import Variances
from boresight.sim.ranges.vectors import Vectors

__all__ = [
    "NEAR",
    "STATE_STATUSES",
    "STATUSES",
    "ClaimResult",
    "Prover",
    "RangesResult",
    "Witness",
    "examine",
]

#: Status of a claim, the best first; and of the range of a state.
STATUSES = ("proven", "conditional", "checked", "tight", "open", "excepted", "refuted")
STATE_STATUSES = (
    *("invariant", "conditional", "checked", "observed"),
    *("excepted", "left", "refuted"),
)
#: Titles of statuses in the text, where the name alone says too little.
_TITLES = {
    "conditional": "proven if other claims hold",
    "checked": "checked on covariances",
    "excepted": "with exceptions",
}
#: Largest number of confirmed claims that the text lists one by one.
_FEW = 8
#: A method that proves a claim, or returns None.
_Method = Callable[[Claim], Proof | None]
#: Share of a range's size from which on a witness shows it to be tight.
NEAR = 0.9


@dataclass(frozen=True)
class Witness:
    """Legal parameters and inputs that lead to an extreme value.

    Attributes
    ----------
    params : dict of str to float
        Values that are not the defaults.
    inputs : dict of str to list of float
        By input, one number for each update after a reset.
    """

    params: dict[str, float]
    inputs: dict[str, list[float]] = field(repr=False)

    @property
    def updates(self) -> int:
        """Number of updates after the reset."""
        return len(next(iter(self.inputs.values())))

    @property
    def last(self) -> str:
        """The last update's inputs."""
        return ", ".join(f"{name} = {values[-1]:.6g}" for name, values in self.inputs.items())


@dataclass(frozen=True)
class ClaimResult:
    """A claim and its status.

    Attributes
    ----------
    value : str
        The reason that its author gives, or the name of the state.
    line : str
        Where it is stated.
    low, high : float
        The range.
    status : str
        One of `STATUSES`; of a state's range one of `STATE_STATUSES`.
    how : str
        How it is proven or checked; a refuted claim may have a proof, too, which leaves out
        rounding and assumes ``conditions``.
    least, most : float
        Range that the search reached.
    share : float
        Largest magnitude reached, as a share of that of the range.
    conditions : tuple of str
        Unproven claims that its proof assumes.
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
    conditions: tuple[str, ...] = ()
    witness: Witness | None = None

    def __str__(self) -> str:
        where = f"{self.value} ({self.line})" if self.line else self.value
        text = f"{self.status:11} [{self.low:g}, {self.high:g}] {where}"
        if self.how:
            text += f": {self.how}"
        if self.conditions:
            text += f", if {'; '.join(self.conditions)}"
        if not self.how or self.witness is not None:
            text += f": reached [{self.least:.6g}, {self.most:.6g}]"
        if self.witness is not None:
            text += f", in update {self.witness.updates} after a reset, {self.witness.last}"
            text += "".join(f", --param {k}={v:.6g}" for k, v in self.witness.params.items())
        return text


@dataclass(frozen=True, eq=False)
class RangesResult(Answer):
    """Result of `boresight.ranges`.

    Attributes
    ----------
    estimator : str
    word : int
    claims : tuple of ClaimResult
    states : tuple of ClaimResult
        Claims that next states are in their ranges, each with one of `STATE_STATUSES`.
    updates : int
        Of the search.
    saturated : dict of str to int
        How often each word saturated in the search.
    """

    judged: ClassVar[Mapping[str, Figure]] = {
        "proven": Figure("claims proven, share", "count", falls=True),
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
        """Whether nothing is refuted."""
        return not self.refuted

    @property
    def refuted(self) -> int:
        """Number of refuted claims, those about next states included."""
        return sum(c.status == "refuted" for c in (*self.claims, *self.states))

    @property
    def proven(self) -> float:
        """Share of the claims about values that are proven unconditionally."""
        proven = sum(c.status == "proven" for c in self.claims)
        return proven / len(self.claims) if self.claims else 1.0

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """Number of ``claims`` and of ``states`` for every status, the best first."""
        return {
            "claims": {s: sum(c.status == s for c in self.claims) for s in STATUSES},
            "states": {s: sum(c.status == s for c in self.states) for s in STATE_STATUSES},
        }

    def to_json(self) -> JsonObject:
        """Return the fields, ``good``, ``proven``, ``refuted`` and ``counts`` as plain data."""
        head = {"good": self.good, "proven": self.proven, "refuted": self.refuted}
        return {**head, "counts": plain(self.counts), **super().to_json()}

    def __str__(self) -> str:
        lines = [f"{self.estimator}, W = {self.word}: {self.updates:,} updates"]
        titles = (("claim", "claims"), ("range of a state", "ranges of states"))
        for (noun, plural), counts in zip(titles, self.counts.values(), strict=True):
            text = ", ".join(f"{n} {_TITLES.get(s, s)}" for s, n in counts.items() if n)
            count = sum(counts.values())
            lines.append(
                f"  {count} {noun if count == 1 else plural}: {text}" if text else f"  no {plural}"
            )
        for status in ("refuted", "excepted", "open", "conditional", "observed", "left"):
            groups: dict[tuple[str, str], list[ClaimResult]] = {}
            for c in (*self.claims, *self.states):
                if c.status == status:
                    groups.setdefault((c.value, c.line), []).append(c)
            for group in groups.values():
                farthest = max(group, key=lambda c: c.share)
                similar = f" (and {len(group) - 1} like it)" if len(group) > 1 else ""
                lines.append(f"  {farthest}{similar}")
        satisfied = [c for c in self.claims if c.status in ("proven", "checked", "tight")]
        lines += [f"  {c}" for c in satisfied] if len(satisfied) <= _FEW else []
        if self.saturated:
            words = ", ".join(f"{name} {count:,}x" for name, count in self.saturated.items())
            lines.append(f"  saturated: {words}")
        lines.append("good" if self.good else f"BAD: {self.refuted} refuted")
        return "\n".join(lines)


def examine(
    estimator: Estimator,
    *,
    word: int = 32,
    updates: int = 100_000,
    seed: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> RangesResult:
    """Prove each claim, and search for inputs that refute it.

    Parameters
    ----------
    updates : int
        Of the search, all runs together.
    """
    steps = -(-updates // RUNS)
    program, nodes = estimator.compile_traced(word=word)
    claims = claims_of(program, nodes)
    prover = Prover(estimator, program, nodes)
    proofs: list[Proof | None] = []
    for k, claim in enumerate(claims):
        progress(f"claim or range of a state {k + 1} of {len(claims)}")
        proofs.append(prover.proof_of(claim))
    search = Search(estimator, program, nodes, claims, seed)
    search.run(steps, progress)
    reached = search.reach()

    state_intervals = _state_intervals(program, nodes, claims, reached)
    conditions = _Conditions(program, claims, reached, prover, state_intervals)
    proofs = conditions.fewer(proofs, prover.methods)
    if assumed_claims := sorted({j for each in conditions.of(proofs) for j in each}):
        conditions.released = prover.without([claims[j] for j in assumed_claims], state_intervals)
        proofs = conditions.fewer(proofs, conditions.released.methods)
    assumed = conditions.of(proofs)
    unproven = [
        k
        for k, (claim, reach) in enumerate(zip(claims, reached, strict=True))
        if proofs[k] is None and not reach.is_violated and _share(claim, reach) < NEAR
    ]
    passed_checks = check_on_covariances(
        estimator, program, nodes, [claims[k] for k in unproven], max(1, steps // 4)
    )
    checked = {unproven[k]: how for k, how in passed_checks.items()}
    results = []
    for k, (claim, reach, proof) in enumerate(zip(claims, reached, proofs, strict=True)):
        how = proof.how if proof else checked.get(k, "")
        share = _share(claim, reach)
        if reach.is_violated:
            status = "excepted" if claim.unless else "refuted" if claim.bounded else "left"
            verb = "would hold" if assumed[k] else "holds but for rounding"
            how = f"{verb} ({how})" if how else ""
        elif proof and assumed[k]:
            status = "tight" if share >= NEAR and not claim.state else "conditional"
        elif proof:
            status = "invariant" if claim.state else "proven"
        elif how:
            status = "checked"
        elif claim.state:
            status = "observed"
        else:
            status = "tight" if share >= NEAR else "open"
        results.append(
            ClaimResult(
                claim.reason + (f", unless {claim.unless}" if claim.unless else ""),
                claim.line,
                claim.low,
                claim.high,
                status,
                how,
                reach.low,
                reach.high,
                share,
                tuple(dict.fromkeys(claims[j].text for j in assumed[k])),
                _witness(estimator, search, reach) if reach.is_violated else None,
            )
        )
    saturating = {op.dest for op in program.ops if op.overflow is Overflow.SAT}
    counts = search.machine.saturations
    return RangesResult(
        estimator=estimator.name,
        word=word,
        claims=tuple(r for r, c in zip(results, claims, strict=True) if not c.state),
        states=tuple(r for r, c in zip(results, claims, strict=True) if c.state),
        updates=steps * RUNS,
        saturated={
            program.values[n].name: int(counts[n])
            for n in np.flatnonzero(counts).tolist()
            if n in saturating
        },
    )


class Prover:
    """The methods that prove a claim.

    Parameters
    ----------
    estimator, program, nodes
        The last two as `Estimator.compile_traced` gives them, or a step without some claims.
    origin : mapping of int to Node
        The nodes of the compiled step, by number; by default those of ``nodes``.
    """

    def __init__(
        self,
        estimator: Estimator,
        program: Program,
        nodes: Mapping[int, Node],
        origin: Mapping[int, Node] | None = None,
    ) -> None:
        self.estimator, self.program, self.nodes = estimator, program, nodes
        self.live = live_nodes(program, nodes)
        self.origin = origin or self.live
        cells, relations = reached_cells(program, nodes), dict[int, float]()
        vectors = Vectors(program, nodes)
        gram = Gram(estimator, program, nodes, vectors)
        methods = (
            gram.proof_of,
            Traces(gram, Norms(vectors)).proof_of,
            Variances(gram, vectors).proof_of,
            lambda claim: proof_of(claim, cells, relations),
            vectors.proof_of,
            partial(proof_in_order, ends=ends_in_order(self.live)),
        )
        self.methods: tuple[_Method, ...] = tuple(cache(partial(self._in_step, m)) for m in methods)
        self.fitting: dict[tuple[int, Format], Proof | None] = {}

    def _in_step(self, method: _Method, claim: Claim) -> Proof | None:
        """Proof by a method for the claim's node in this step; None if its word may saturate."""
        node = self.live.get(claim.node.number)
        if node is None or (claim.node.args and not node.args):
            return None
        proof = method(replace(claim, node=node))
        return proof and replace(proof, aliases=tuple(self.origin[n.number] for n in proof.aliases))

    def fits(self, claim: Claim, form: Format) -> Proof | None:
        """A proof that the value of a claim does not saturate a format, whatever the claim."""
        key = claim.node.number, form
        if key not in self.fitting:
            ends = ((1.0 - ROOM) * end for end in (form.min, form.max))
            self.fitting[key] = self.proof_of(replace(claim, low=next(ends), high=next(ends)))
        return self.fitting[key]

    def without(self, claims: Sequence[Claim], states: Mapping[int, tuple[float, float]]) -> Prover:
        """The prover of the step without some claims; ``states`` as of `released`."""
        updated = released(self.program, self.nodes, [c for c in claims if not c.state], states)
        nodes = {value: updated.get(node.number, node) for value, node in self.nodes.items()}
        return Prover(self.estimator, self.program, nodes, self.origin)

    def proof_of(self, claim: Claim) -> Proof | None:
        """The first proof that a method finds."""
        return next((p for method in self.methods if (p := method(claim)) is not None), None)


class _Conditions:
    """The unproven claims that proofs assume.

    Attributes
    ----------
    prover, released : Prover
        Of the compiled step, and of the step without the claims that proofs assume.
    """

    def __init__(
        self,
        program: Program,
        claims: Sequence[Claim],
        reached: Sequence[Reach],
        prover: Prover,
        state_intervals: Mapping[int, tuple[float, float]],
    ) -> None:
        self.claims, self.reached, self.prover = claims, reached, prover
        self.released: Prover | None = None
        state_words = {program.values[state].name: state for state, _ in program.states}
        self.formats = [
            None if (word := state_words.get(c.state, c.word)) is None else program.format(word)
            for c in claims
        ]
        self.violations = [reach.is_violated for reach in reached]
        fits = [
            f is not None and _holds(f, c.ends) for f, c in zip(self.formats, claims, strict=True)
        ]
        self.assumptions = Assumptions(claims, self.violations, fits, _needs_of(state_intervals))

    def of(self, proofs: Sequence[Proof | None]) -> list[list[int]]:
        """Indices of the claims that each proof assumes."""
        bases = [None if proof is None else proof.base for proof in proofs]
        aliases = [() if proof is None else proof.aliases for proof in proofs]
        arguments = {n.args[0].number for each in aliases for n in each}

        def fitting_proofs(
            is_tried: Callable[[int], bool],
        ) -> dict[int, tuple[Sequence[Node], Sequence[Node]]]:
            out: dict[int, tuple[Sequence[Node], Sequence[Node]]] = {}
            each = zip(self.claims, self.formats, self.reached, strict=True)
            for k, (c, form, reach) in enumerate(each):
                if form is None or c.node.number not in arguments or not is_tried(k):
                    continue
                if form.min < reach.low and reach.high < form.max:
                    proof = self._fits(c, form)
                    if proof is not None:
                        out[k] = proof.base, proof.aliases
            return out

        wider = fitting_proofs(lambda k: proofs[k] is None or self.violations[k])
        indices = self.assumptions.of(bases, aliases, wider)
        optional = fitting_proofs(lambda k: k not in wider and bool(indices[k]))
        if optional:  # a proof that the format holds a value may assume less than that of its range
            alternatives = self.assumptions.of(bases, aliases, wider | optional)
            indices = [min(each, key=len) for each in zip(indices, alternatives, strict=True)]
        return indices

    def fewer(
        self, proofs: Sequence[Proof | None], methods: Sequence[_Method]
    ) -> list[Proof | None]:
        """The proofs, replaced by those of other methods that assume fewer claims."""
        proofs, assumed = [*proofs], self.of(proofs)
        for method in 2 * [*methods]:  # a replacement may remove the assumption of another proof
            trials = [
                method(c) or p if p and a else p
                for c, p, a in zip(self.claims, proofs, assumed, strict=True)
            ]
            if trials != proofs:
                fewer = [len(b) < len(a) for a, b in zip(assumed, self.of(trials), strict=True)]
                proofs = [o if b else p for p, o, b in zip(proofs, trials, fewer, strict=True)]
                assumed = self.of(proofs)
        return proofs

    def _fits(self, claim: Claim, form: Format) -> Proof | None:
        """A proof that a format holds a value, if possible in the step without claims."""
        proof = None if self.released is None else self.released.fits(claim, form)
        return proof or self.prover.fits(claim, form)


def _state_intervals(
    program: Program, nodes: Mapping[int, Node], claims: Sequence[Claim], reached: Sequence[Reach]
) -> dict[int, tuple[float, float]]:
    """Intervals of the states that leave their ranges, by number.

    The end that a state passes is that of its format, the other that of its range.
    """
    states = {program.values[state].name: state for state, _ in program.states}
    out = {}
    for c, reach in zip(claims, reached, strict=True):
        if c.state and reach.is_violated:
            form, low, high = program.format(states[c.state]), *c.ends
            low = form.min if reach.low < low else c.low
            out[nodes[states[c.state]].number] = low, form.max if reach.high > high else c.high
    return out


def _needs_of(intervals: Mapping[int, tuple[float, float]]) -> Callable[[Node], Sequence[Node]]:
    """Arguments from whose intervals that of a node follows, with these intervals of states."""
    memo: dict[Node, Sequence[Node]] = {}  # a step without some claims has the same numbers

    def needs(node: Node) -> Sequence[Node]:
        if node not in memo:
            memo[node] = interval_needs(node, intervals)
        return memo[node]

    return needs


def _holds(form: Format, ends: tuple[float, float]) -> bool:
    """Whether saturation keeps the words of a format in a range."""
    return ends[0] <= form.min and form.max <= ends[1]


def _witness(estimator: Estimator, search: Search, reach: Reach) -> Witness:
    params, rows = search.path(reach)
    defaults = {p.name: p.default for p in estimator.params}
    return Witness(
        {name: value for name, value in params.items() if value != defaults[name]},
        {i.name: rows[:, k].tolist() for k, i in enumerate(estimator.inputs)},
    )


def _share(claim: Claim, reach: Reach) -> float:
    return max(-reach.low, reach.high) / claim.size if claim.size else 1.0
