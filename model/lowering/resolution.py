"""Whether words can hold what was declared: last bits against tolerances and ranges of states."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from boresight.model.declarations import EXACT_UNITS
from boresight.model.errors import InputError
from boresight.model.lowering.graph import Node
from boresight.model.places import placed
from boresight.model.words.program import Kind, Op, Program, Scale

__all__ = ["check_resolution"]


#: Share of its bits that what reaches a state has to leave it.
_LEFT = 0.25


def check_resolution(program: Program, nodes: Mapping[int, Node]) -> None:
    """Refuse words whose last bit is too coarse for what is made of them.

    That is one that reaches an output, as a copy, a term of a sum, a side of a selection or times a
    constant, with more than the output's tolerance; and one that so reaches the next value of a
    state and leaves it less than a quarter of its bits.

    Parameters
    ----------
    program, nodes
        As `Estimator.compile_traced` gives them.

    Raises
    ------
    InputError
        See above; with the line that computes the word.
    """
    walk = _Walk(program)
    for number, port in zip(program.outputs, program.ports, strict=True):
        if port.tolerance and port.unit not in EXACT_UNITS:
            walk.refuse(number, port.tolerance, f"the tolerance of output {port.name}", nodes)
    spare = math.floor(program.arithmetic.word * (1.0 - _LEFT))
    for state, after in program.states:
        limit = math.ldexp(1.0, spare - program.values[state].frac)
        said = f"a quarter of the bits of state {program.values[state].name}"
        walk.refuse(after, limit, said, nodes)


class _Walk:
    """From a value to all that it is made of by sums, selections, constant factors and states."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.op_of = {op.dest: op for op in program.ops}
        self.after = dict(program.states)
        self.constants = {n for n, v in enumerate(program.values) if v.kind is Kind.CONST}
        for op in program.ops:  # what is chosen among constants is not rounded either
            if self.constants.issuperset({n for t in op.terms for n in (t.a, t.b)}):
                self.constants.add(op.dest)

    def refuse(self, number: int, limit: float, of: str, nodes: Mapping[int, Node]) -> None:
        """Raise InputError if a last bit reaches a value with more than ``limit``."""
        for value, share in self._parts(number):
            said = self.program.values[value]
            last = math.ldexp(1.0, -said.frac)
            if last * share > limit:
                line = nodes[value].line if value in nodes else ""
                computed = said.kind is Kind.OP
                raise InputError.at(
                    placed(line, f"{self.program.name}, value {said.name}"),
                    wanted=f"a last bit of at most {limit / share:.3g}, for {of}",
                    found=f"{last:.3g}, of [{said.low:.4g}, {said.high:.4g}]",
                    fix="limit it, or what it is made of, with ops.bounded or ops.clip"
                    if computed
                    else "narrow its range, or widen the tolerance",
                )

    def _parts(self, number: int) -> Iterator[tuple[int, float]]:
        """Values that reach one, each once, and how much of an error of theirs does."""
        ahead, seen = [(number, 1.0)], set(self.constants)
        for value, share in ahead:
            if value not in seen:
                seen.add(value)
                yield value, share
                if value in self.op_of:
                    ahead += self._terms(self.op_of[value], share)
                elif value in self.after:  # as the last update left it
                    ahead.append((self.after[value], share))

    def _terms(self, op: Op, share: float) -> Iterator[tuple[int, float]]:
        values, guard = self.program.values, self.program.arithmetic.guard
        for term in op.terms:
            if term.b is None or term.scale is not Scale.NONE or term.fraction_a:
                continue
            for number, factor in ((term.a, term.b), (term.b, term.a)):
                if values[factor].kind is Kind.CONST:
                    size = abs(values[factor].initial) * share
                    exponent = values[number].frac - term.shift - guard - values[op.dest].frac
                    yield number, math.ldexp(size, exponent)
