"""The claims that have to be true for no word of a program to overflow.

The interval of every other value follows from those of its arguments, and its format holds it
(`model.lowering.groups`). Two kinds of claims are assumed when a step is compiled: those stated
with `ops.bounded`, by its author or by the toolkit where it expands a function, and that a next
state stays in the declared range of its state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Overflow, Program

__all__ = ["TOLERANCE", "Assumptions", "Claim", "Premises", "Proof", "claims_of", "live"]

#: Share of the size of a range by which a value may pass its end, by rounding.
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Claim:
    """A claim that a value is in a range.

    Attributes
    ----------
    node : Node
        The value.
    low, high : float
        The range.
    reason : str
        That of its author, or "range of the state NAME".
    line : str
        Where it is stated.
    word : int or None
        Value number of the word that holds it; None: the value is part of another operation.
    state : str
        Name of the state whose next value it is, or empty.
    bounded : bool
        Whether `ops.bounded` states the claim; else the declaration of a state does.
    unless : str
        The exception that its author states, or empty.
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
    def text(self) -> str:
        """The reason, and the line."""
        return f"{self.reason} ({self.line})" if self.line else self.reason

    @property
    def ends(self) -> tuple[float, float]:
        """The range, widened by what rounding explains."""
        slack = TOLERANCE * self.size
        return self.low - slack, self.high + slack

    def holds(self, smallest: float, largest: float) -> bool:
        """Whether values from the smallest to the largest are in the range."""
        low, high = self.ends
        return low <= smallest and largest <= high


@dataclass(frozen=True, eq=False)
class Proof:
    """A proof of a claim.

    Attributes
    ----------
    how : str
        The method: "interval", "length of vectors".
    base : tuple of Node
        The nodes whose intervals in the compiled step it uses.
    aliases : tuple of Node
        "bounded" nodes that it equates with their arguments, in this update or, by induction, in
        earlier ones: their words hold the arguments.
    """

    how: str
    base: tuple[Node, ...]
    aliases: tuple[Node, ...] = ()


@dataclass
class Premises:
    """Premises of a proof, as they are collected.

    Attributes
    ----------
    base : set of Node
        As of a `Proof`.
    aliases : set of int
        The same, by number.
    """

    base: set[Node] = field(default_factory=set)
    aliases: set[int] = field(default_factory=set)

    def proof(self, how: str, nodes: Mapping[int, Node]) -> Proof:
        """Return the proof, in a step with these nodes."""
        base = sorted(self.base, key=lambda node: node.number)
        return Proof(how, tuple(base), tuple(nodes[n] for n in sorted(self.aliases)))


def live(
    roots: Sequence[Node], needs: Callable[[Node], Sequence[Node]] = lambda node: node.args
) -> Iterator[Node]:
    """Nodes that the roots need, each after its arguments, or after those of ``needs``."""
    visited = {node.number: node for node in roots}
    stack = list(visited.values())
    while stack:
        node = stack.pop()
        for arg in needs(node):
            if arg.number not in visited:
                visited[arg.number] = arg
                stack.append(arg)
    yield from (visited[number] for number in sorted(visited))


def claims_of(program: Program, nodes: Mapping[int, Node]) -> list[Claim]:
    """The claims of a compiled step, in the order of computation; next states last.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """
    state_ranges = {
        nodes[next_state].number: (program.values[state].low, program.values[state].high)
        for state, next_state in program.states
        if next_state in nodes
    }
    results = [*program.outputs, *(next_state for _, next_state in program.states)]
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
        if node.kind == "bounded" and state_ranges.get(node.number) != (node.low, node.high)
    ]
    clamped = {op.dest for op in program.ops if op.overflow is not Overflow.SAT}
    for state, next_state in program.states:
        value, node = program.values[state], nodes.get(next_state)
        if node is not None and next_state != state and next_state not in clamped:
            bounded = node.kind == "bounded" and state_ranges[node.number] == (node.low, node.high)
            fields = (value.name, bounded, node.unless if bounded else "")
            node = node.args[0] if bounded else node  # with another range it is a claim itself
            reason = f"range of the state {value.name}"
            out.append(Claim(node, value.low, value.high, reason, node.line, next_state, *fields))
    return out


class Assumptions:
    """Unproven claims that proofs assume.

    An interval follows from those of its arguments down to a value with a claim, where the claim
    replaces it. Where a claim is proven, the assumptions of its proof count instead.

    Parameters
    ----------
    claims
        As `claims_of` gives them.
    violations
        Whether inputs break the claim, in spite of a proof in real numbers. Intervals of states
        are assumed, too, if those of their next values are broken.
    limits
        Whether the format of the word that others read keeps any value in the range: then nothing
        is assumed.
    needs
        Arguments from whose intervals that of a node follows.
    """

    def __init__(
        self,
        claims: Sequence[Claim],
        violations: Sequence[bool],
        limits: Sequence[bool],
        needs: Callable[[Node], Sequence[Node]],
    ) -> None:
        self.violations, self.limits, self.needs = violations, limits, needs
        self.index = {(c.node.number, c.low, c.high): k for k, c in enumerate(claims)}
        self.of_state = {
            c.state: k for k, c in enumerate(claims) if c.state and violations[k] and not limits[k]
        }
        self.memo: dict[frozenset[Node], frozenset[int]] = {}  # by the nodes of intervals

    def of(
        self,
        bases: Sequence[Sequence[Node] | None],
        aliases: Sequence[Sequence[Node]],
        wider: Mapping[int, tuple[Sequence[Node], Sequence[Node]]],
    ) -> list[list[int]]:
        """The claims that the proof of each claim assumes; indices.

        Parameters
        ----------
        bases
            Nodes whose intervals each proof uses; None: the claim has no proof.
        aliases
            "bounded" nodes that each proof equates with their arguments: it assumes all that these
            assume, in earlier updates, too.
        wider
            By the index of a claim, the base and the aliases of a proof that its value fits
            the format. A proof that equates the claim's node assumes this instead of the claim.
        """
        count = len(bases)
        sound = [base is not None and not b for base, b in zip(bases, self.violations, strict=True)]
        fit_index = {j: count + k for k, j in enumerate(wider)}  # numbered after the claims

        def indices(nodes: Sequence[Node]) -> set[int]:
            return {fit_index.get(j, j) for j in {*map(self._claim_of, nodes)} if j is not None}

        proofs = [*zip(bases, aliases, strict=True), *wider.values()]
        premises = [self._claims_behind(base or ()) | indices(nodes) for base, nodes in proofs]
        sound += [True] * len(fit_index)
        assumed = [sum(1 << j for j in each if not sound[j]) for each in premises]  # a bit for each
        proven_premises = [[j for j in each if sound[j]] for each in premises]
        previous: list[int] = []
        while previous != assumed:  # assumptions on an earlier update may be proven by it
            previous = [*assumed]
            for k, each in enumerate(proven_premises):
                for j in each:
                    assumed[k] |= assumed[j]
        return [[j for j in range(count) if each >> j & 1] for each in assumed[:count]]

    def _claim_of(self, node: Node) -> int | None:
        """Index of the claim that a node's interval is, or None."""
        if node.kind == "state":
            return self.of_state.get(node.name or "")
        ends = (node.args[0].number, node.low, node.high) if node.kind == "bounded" else None
        return None if ends is None else self.index.get(ends)

    def _claims_behind(self, nodes: Sequence[Node]) -> frozenset[int]:
        """Claims from which the intervals of nodes follow."""
        key = frozenset(nodes)  # not their numbers: a step without some claims has the same
        if key not in self.memo:
            closure = live(nodes, lambda n: () if self._claim_of(n) is not None else self.needs(n))
            indices = (self._claim_of(node) for node in closure)
            self.memo[key] = frozenset(j for j in indices if j is not None and not self.limits[j])
        return self.memo[key]
