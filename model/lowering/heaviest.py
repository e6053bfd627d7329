"""Which lines of an estimator make most of its operations: what to look at where a core is full."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from boresight.model.lowering.graph import Node
from boresight.model.words.program import Program

__all__ = ["heaviest", "operations_by_line"]

#: Lines that are named.
_NAMED = 3


def operations_by_line(program: Program, nodes: Mapping[int, Node]) -> Counter[str]:
    """How many operations each line makes; parts count where they are used first.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.
    """
    counts: Counter[str] = Counter()
    parts = 0
    for op in program.ops:
        parts += 1
        line = nodes[op.dest].line if op.dest in nodes else ""
        if line:
            counts[line] += parts
            parts = 0
    return counts


def heaviest(traced: Sequence[tuple[Program, Mapping[int, Node]]]) -> str:
    """The lines with most operations of all programs, as the end of an error's line."""
    total = sum(len(program.ops) for program, _ in traced)
    if not total:
        return ""
    counts = Counter[str]()
    for program, nodes in traced:
        prefix = f"{program.name}, " if len(traced) > 1 else ""
        for line, count in operations_by_line(program, nodes).items():
            counts[prefix + line] += count
    named = ", ".join(f"{line} ({count})" for line, count in counts.most_common(_NAMED))
    return f"; most of its {total} operations: {named}"
