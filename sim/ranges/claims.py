"""The claims that have to be true for no word of a program to overflow.

The interval of every other value follows from those of its arguments, and its format holds it
(`model.lowering.groups`). Two kinds of claims are assumed when a step is compiled: those stated
with `ops.bounded`, by its author or by the toolkit where it expands a function, and that a next
state stays in the declared range of its state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Overflow, Program
from boresight.sim.compare.twin import RANGE_SLACK

#: Share of a range's larger magnitude, and last bits of its word, by which rounding may exceed it.
TOLERANCE = 1e-4
ROUNDING_LSB = 8.0


@dataclass(frozen=True, eq=False)
class Claim:
    """A claim that a value is in a range."""

    #: The value.
    node: Node
    #: The range.
    low: float
    high: float
    #: The author's reason, or "range of the state NAME".
    reason: str
    #: Where it is stated.
    line: str
    #: Number of the program's value that holds it; None if it is part of another operation.
    word: int | None
    #: Last bit of that word, or 0.
    lsb: float = 0.0
    #: Name of the state whose next value it is, or empty.
    state: str = ""
    #: Whether `ops.bounded` states the claim; otherwise the declaration of a state does.
    bounded: bool = True
    #: The exception that the author states, or empty.
    unless: str = ""

    @property
    def size(self) -> float:
        """Magnitude of the farther end."""
        return max(abs(self.low), abs(self.high))

    @property
    def ends(self) -> tuple[float, float]:
        """The range, widened by what rounding explains."""
        share = RANGE_SLACK * (self.high - self.low) if self.state else TOLERANCE * self.size
        slack = max(share, ROUNDING_LSB * self.lsb)
        return self.low - slack, self.high + slack

    def broken_by(self, seen: tuple[float, float]) -> bool:
        """Whether extremes lie beyond the range by more than rounding."""
        return not self.ends[0] <= seen[0] <= seen[1] <= self.ends[1]

    def share(self, low: float, high: float) -> float:
        """How far values from ``low`` to ``high`` go towards an end; above 1: beyond it."""
        if self.low < 0.0 < self.high:
            return max(low / self.low, high / self.high)
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        return max(middle - low, high - middle) / half if half else 1.0


def live(roots: Sequence[Node]) -> Iterator[Node]:
    """Yield the nodes that the roots need, each after its arguments."""
    visited = {node.number: node for node in roots}
    stack = list(visited.values())
    while stack:
        for arg in stack.pop().args:
            if arg.number not in visited:
                visited[arg.number] = arg
                stack.append(arg)
    yield from (visited[number] for number in sorted(visited))


def claims_of(program: Program, nodes: Mapping[int, Node]) -> list[Claim]:
    """List the claims of a compiled step in the order of computation; next states last.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """

    def lsb(value: int | None) -> float:
        return 0.0 if value is None else program.format(value).lsb

    state_ranges = {
        nodes[after].number: (program.values[state].low, program.values[state].high)
        for state, after in program.states
        if after in nodes
    }
    results = (*program.outputs, *(after for _, after in program.states))
    word_of = {node.number: number for number, node in reversed([*nodes.items()])}
    claims = [
        Claim(
            node.args[0],
            node.low,
            node.high,
            node.reason,
            node.line,
            word_of.get(node.number),
            lsb(word_of.get(node.number)),
            unless=node.unless,
        )
        for node in live([nodes[n] for n in results if n in nodes])
        if node.kind == "bounded" and state_ranges.get(node.number) != (node.low, node.high)
    ]
    clamped = {op.dest for op in program.ops if op.overflow is not Overflow.SAT}
    for state, after in program.states:
        declared, node = program.values[state], nodes.get(after)
        if node is None or after == state or after in clamped:
            continue
        # With another range than the state's, ops.bounded is a claim of its own.
        bounded = node.kind == "bounded" and state_ranges[node.number] == (node.low, node.high)
        claims.append(
            Claim(
                node.args[0] if bounded else node,
                declared.low,
                declared.high,
                f"range of the state {declared.name}",
                node.line,
                after,
                lsb(after),
                state=declared.name,
                bounded=bounded,
                unless=node.unless if bounded else "",
            )
        )
    return claims
