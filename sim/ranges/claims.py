"""What has to be true for no word of a program to overflow.

The interval of every other value follows from those of its arguments, and its format holds it
(`model.lowering.groups`). Two things are taken on trust when a step is compiled: what its author
says with `ops.bounded`, or the toolkit where it expands a function, and that a next state stays in
the declared range of its state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Overflow, Program

__all__ = ["TOLERANCE", "Claim", "claims_of", "live"]

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
    state : bool
        Whether it is that of a next state.
    """

    node: Node
    low: float
    high: float
    reason: str
    line: str
    word: int | None
    state: bool = False

    @property
    def size(self) -> float:
        """Magnitude of the farther end."""
        return max(abs(self.low), abs(self.high))

    @property
    def ends(self) -> tuple[float, float]:
        """The range, and what rounding explains."""
        slack = TOLERANCE * self.size
        return self.low - slack, self.high + slack


def live(roots: Sequence[Node]) -> Iterator[Node]:
    """Nodes that the roots need, each after its arguments."""
    seen = {node.number: node for node in roots}
    stack = list(seen.values())
    while stack:
        for arg in stack.pop().args:
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
        )
        for node in live([nodes[n] for n in results if n in nodes])
        if node.kind == "bounded" and replacing.get(node.number) != (node.low, node.high)
    ]
    clamped = {op.dest for op in program.ops if op.overflow is not Overflow.SAT}
    for state, after in program.states:
        declared, node = program.values[state], nodes.get(after)
        if node is not None and node.kind == "bounded":  # of the same range, or a claim itself
            node = node.args[0] if replacing[node.number] == (node.low, node.high) else node
        if node is not None and after != state and after not in clamped:
            reason = f"range of the state {declared.name}"
            out.append(
                Claim(node, declared.low, declared.high, reason, node.line, after, state=True)
            )
    return out
