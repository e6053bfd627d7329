"""What has to be true for no word of a program to overflow.

The interval of every other value follows from those of its arguments, and its format holds it
(`model.lowering.groups`). Two things are taken on trust when a step is compiled: what its author
says with `ops.bounded`, or the toolkit where it expands a function, and that a next state stays in
the declared range of its state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Overflow, Program

__all__ = ["TOLERANCE", "Assumptions", "Claim", "Premises", "Proof", "claims_of", "live"]

#: Share of its size by which a value may pass the end of its range: what rounding explains.
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Claim:
    """That a value is in a range.

    Attributes
    ----------
    node : Node
        The value.
    low, high : float
        The range.
    reason : str
        Its author's, or "range of the state NAME".
    line : str
        Where it is stated.
    word : int or None
        Value number of the word that holds it; None: it is part of another operation.
    state : str
        Name of the state whose next value it is; empty: of none.
    bounded : bool
        Whether `ops.bounded` makes the claim; else the declaration of a state does.
    unless : str
        When its author says that the value leaves the range; empty: never.
    """

    node: Node
    low: float
    high: float
    reason: str
    line: str
    word: int | None
    state: str = ""
    bounded: bool = True
    unless: str = ""

    @property
    def size(self) -> float:
        """Magnitude of the farther end."""
        return max(abs(self.low), abs(self.high))

    @property
    def said(self) -> str:
        """The reason, and the line."""
        return f"{self.reason} ({self.line})" if self.line else self.reason

    @property
    def ends(self) -> tuple[float, float]:
        """The range, and what rounding explains."""
        slack = TOLERANCE * self.size
        return self.low - slack, self.high + slack

    def holds(self, least: float, most: float) -> bool:
        """Whether values from the least to the most are in the range."""
        low, high = self.ends
        return low <= least and most <= high


@dataclass(frozen=True, eq=False)
class Proof:
    """Of a claim.

    Attributes
    ----------
    how : str
        By what: "interval", "length of vectors".
    base : tuple of Node
        The nodes whose intervals in the compiled step it uses.
    passed : tuple of Node
        "bounded" ones that it takes as their arguments, in this update or, by induction, in those
        before: their words hold them.
    """

    how: str
    base: tuple[Node, ...]
    passed: tuple[Node, ...] = ()


@dataclass
class Premises:
    """What a proof rests on, as it is collected.

    Attributes
    ----------
    base : set of Node
        As of a `Proof`.
    passed : set of int
        The same, by number.
    """

    base: set[Node] = field(default_factory=set)
    passed: set[int] = field(default_factory=set)

    def proof(self, how: str, nodes: Mapping[int, Node]) -> Proof:
        """The proof, of a step with these nodes."""
        base = sorted(self.base, key=lambda node: node.number)
        return Proof(how, tuple(base), tuple(nodes[n] for n in sorted(self.passed)))


def live(
    roots: Sequence[Node], needs: Callable[[Node], Sequence[Node]] = lambda node: node.args
) -> Iterator[Node]:
    """Nodes that the roots need, each after its arguments, or those that ``needs`` gives."""
    seen = {node.number: node for node in roots}
    stack = list(seen.values())
    while stack:
        node = stack.pop()
        for arg in needs(node):
            if arg.number not in seen:
                seen[arg.number] = arg
                stack.append(arg)
    yield from (seen[number] for number in sorted(seen))


def claims_of(program: Program, nodes: Mapping[int, Node]) -> list[Claim]:
    """The claims of a compiled step, in the order of computation; next states last.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """
    replacing = {
        nodes[after].number: (program.values[state].low, program.values[state].high)
        for state, after in program.states
        if after in nodes
    }
    results = [*program.outputs, *(after for _, after in program.states)]
    word_of = {node.number: number for number, node in reversed([*nodes.items()])}
    out = [
        Claim(
            node.args[0],
            node.low,
            node.high,
            node.source.removeprefix("declared: "),
            node.line,
            word_of.get(node.number),
            unless=node.unless,
        )
        for node in live([nodes[n] for n in results if n in nodes])
        if node.kind == "bounded" and replacing.get(node.number) != (node.low, node.high)
    ]
    clamped = {op.dest for op in program.ops if op.overflow is not Overflow.SAT}
    for state, after in program.states:
        declared, node = program.values[state], nodes.get(after)
        if node is not None and after != state and after not in clamped:
            bounded = node.kind == "bounded" and replacing[node.number] == (node.low, node.high)
            said = (declared.name, bounded, node.unless if bounded else "")
            node = node.args[0] if bounded else node  # of another range it is a claim itself
            reason = f"range of the state {declared.name}"
            out.append(Claim(node, declared.low, declared.high, reason, node.line, after, *said))
    return out


class Assumptions:
    """Which claims proofs assume without a proof.

    An interval follows from those of its arguments down to a value with a claim, where the claim
    takes its place. A proven claim hands on what its own proof assumes.

    Parameters
    ----------
    claims
        As `claims_of` gives them.
    broken
        Whether inputs break the claim, in spite of a proof in real numbers. The intervals of
        states are assumed, too, where that of their next values is broken.
    held
        Whether the format of the word that others read holds it in the range, whatever the value:
        nothing is assumed then.
    needs
        Arguments from whose intervals that of a node follows.
    """

    def __init__(
        self,
        claims: Sequence[Claim],
        broken: Sequence[bool],
        held: Sequence[bool],
        needs: Callable[[Node], Sequence[Node]],
    ) -> None:
        self.broken, self.held, self.needs = broken, held, needs
        self.index = {(c.node.number, c.low, c.high): k for k, c in enumerate(claims)}
        self.of_state = {
            c.state: k for k, c in enumerate(claims) if c.state and broken[k] and not held[k]
        }
        self.known: dict[frozenset[Node], frozenset[int]] = {}  # of intervals, by their nodes

    def of(
        self,
        bases: Sequence[Sequence[Node] | None],
        passed: Sequence[Sequence[Node]],
        wider: Mapping[int, tuple[Sequence[Node], Sequence[Node]]],
    ) -> list[list[int]]:
        """The claims that the proof of each claim assumes; indices.

        Parameters
        ----------
        bases
            Nodes whose intervals each proof uses; None: the claim has no proof.
        passed
            "bounded" nodes that each proof takes as their arguments: what these assume, it assumes,
            in the updates before, too.
        wider
            Of a claim, by index: what proves that its value fits the format, as ``bases`` and
            ``passed`` say. What takes the word as its argument assumes that, and not the claim.
        """
        count = len(bases)
        sound = [base is not None and not b for base, b in zip(bases, self.broken, strict=True)]
        fits = {j: count + k for k, j in enumerate(wider)}  # numbered after the claims

        def taken(nodes: Sequence[Node]) -> set[int]:
            return {fits.get(j, j) for j in {*map(self._stated, nodes)} if j is not None}

        proofs = [*zip(bases, passed, strict=True), *wider.values()]
        needed = [self._of_intervals(base or ()) | taken(nodes) for base, nodes in proofs]
        sound += [True] * len(fits)
        assumed = [sum(1 << j for j in each if not sound[j]) for each in needed]  # a bit for each
        proven = [[j for j in each if sound[j]] for each in needed]
        before: list[int] = []
        while before != assumed:  # what a proof assumes of an update before may be proven by it
            before = [*assumed]
            for k, each in enumerate(proven):
                for j in each:
                    assumed[k] |= assumed[j]
        return [[j for j in range(count) if each >> j & 1] for each in assumed[:count]]

    def _stated(self, node: Node) -> int | None:
        """The claim that takes a node's place."""
        if node.kind == "state":
            return self.of_state.get(node.name or "")
        ends = (node.args[0].number, node.low, node.high) if node.kind == "bounded" else None
        return None if ends is None else self.index.get(ends)

    def _of_intervals(self, nodes: Sequence[Node]) -> frozenset[int]:
        """Claims that the intervals of nodes rest on."""
        key = frozenset(nodes)  # not their numbers: a step without some claims has the same
        if key not in self.known:
            below = live(nodes, lambda n: () if self._stated(n) is not None else self.needs(n))
            stated = (self._stated(node) for node in below)
            self.known[key] = frozenset(j for j in stated if j is not None and not self.held[j])
        return self.known[key]
