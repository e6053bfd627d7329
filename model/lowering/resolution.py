"""Whether words can hold what was declared: last bits against tolerances and ranges of states."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from boresight.model.declarations import EXACT_UNITS
from boresight.model.errors import InputError, placed
from boresight.model.lowering.graph import Node, declared_name
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value

#: Share of a state's bits that the words reaching it must leave exact.
_LEFT = 0.25


def limits(program: Program, nodes: Mapping[int, Node]) -> Iterator[tuple[int, float, str]]:
    """How far each output, then each next state, may be off: its value, by how much, and why.

    An output by its tolerance, by anything where it has none, by one bit if it is compared bit by
    bit; a state by what leaves it a quarter of its bits.
    """
    for number, port in zip(program.outputs, program.ports, strict=True):
        if port.unit in EXACT_UNITS:
            yield number, 1.0, f"bit 0 of output {port.name}"
        else:
            yield number, port.tolerance or math.inf, f"the tolerance of output {port.name}"
    bits = math.floor(program.arithmetic.word * (1.0 - _LEFT))
    for state, after in program.states:
        limit = math.ldexp(1.0, bits - program.values[state].frac)
        yield after, limit, f"a quarter of the bits of state {declared_name(program, nodes, state)}"


def check_resolution(program: Program, nodes: Mapping[int, Node]) -> None:
    """Refuse words whose last bit is too coarse for the outputs and states computed from them.

    Such a word reaches an output or a next state, as a copy, a term of a sum, a side of a selection
    or times a constant, and its last bit there exceeds the limit (`limits`). The InputError names
    the line that computes the word.
    """
    walk = _Walk(program, nodes)
    for number, limit, reason in limits(program, nodes):
        walk.refuse(number, limit, reason)


class _Walk:
    """Walks from a value to its sources, by sums, selections, constant factors and states."""

    def __init__(self, program: Program, nodes: Mapping[int, Node]) -> None:
        self.program, self.nodes = program, nodes
        self.op_of = {op.dest: op for op in program.ops}
        self.after = dict(program.states)
        self.values: dict[int | None, Value] = dict(enumerate(program.values))
        #: Values that are not rounded (constants, their sums and selections), and how often two
        #: divides their words.
        constants = {n: program.values[n].initial for n in program.of_kind(Kind.CONST)}
        self.exact: dict[int | None, int] = {
            n: (word & -word).bit_length() - 1 if word else 64 for n, word in constants.items()
        }
        for op in program.ops:
            if all(n in self.exact for t in op.terms for n in (t.a, t.b)):
                twos = [self.exact[t.a] + self.exact[t.b] + self._power(op, t) for t in op.terms]
                exponent = min(twos) + self.values[op.dest].frac
                if exponent >= 0 and op.dest in nodes and self._is_whole(op):
                    self.exact[op.dest] = exponent

    def refuse(self, number: int, limit: float, reason: str) -> None:
        """Raise InputError if a last bit reaches a value with more than ``limit``."""
        for value, share in self._parts(number):
            declared = self.program.values[value]
            last = math.ldexp(1.0, -declared.frac)
            if last * share > limit:
                span, name = self.nodes.get(value, declared), self._named(value)
                raise InputError.at(
                    placed(self._line(value), f"{self.program.name}, {name}"),
                    wanted=f"an LSB of at most {limit / share:.3g}, for {reason}",
                    found=f"{last:.3g}, for the range [{span.low:.4g}, {span.high:.4g}]",
                    fix=self._remedy(value),
                )

    def _named(self, value: int) -> str:
        """What its author calls a value, or the kind of expression."""
        node, of = self.nodes.get(value), self.program.values[value]
        if node is not None and of.kind is Kind.OP and not (node.name or node.title):
            return node.description
        return f"value {declared_name(self.program, self.nodes, value)}"

    def _line(self, value: int) -> str:
        """Where its author wrote it, or what a part of a sum is added to."""
        for op in self.program.ops:
            if value not in self.nodes and value in op.operands():
                value = op.dest
        return self.nodes[value].line if value in self.nodes else ""

    def _remedy(self, value: int) -> str:
        declared, node = self.program.values[value], self.nodes.get(value)
        if declared.kind is not Kind.OP:
            return "narrow its range, or widen the tolerance"
        for number, after in self.program.states:
            state = self.program.values[number]
            if self.nodes.get(after) is node is not None and declared.frac == state.frac:
                name = declared_name(self.program, self.nodes, number)
                ends = f"[{state.low:g}, {state.high:g}]"
                return f"narrow the range {ends} of state {name}, or widen the tolerance"
        profiled = any(n.fit is not None for n in self.nodes.values())
        fit = "" if profiled else ", or use boresight fit"
        return f"limit it, or its factors, with ops.bounded or ops.clip{fit}, or use a wider word"

    def _parts(self, number: int) -> Iterator[tuple[int, float]]:
        """Values that reach a value, each once, and the share of their error that does."""
        queue, visited = [(number, 1.0)], {*self.exact}
        for value, share in queue:
            if value not in visited:
                visited.add(value)
                yield value, share
                if value in self.op_of:
                    queue += self._terms(self.op_of[value], share)
                elif value in self.after:  # as the last update left it
                    queue.append((self.after[value], share))

    def _terms(self, op: Op, share: float) -> Iterator[tuple[int, float]]:
        values = self.program.values
        for term in op.terms:
            if term.b is None or term.scale is not Scale.NONE:
                continue
            for number, factor in ((term.a, term.b), (term.b, term.a)):
                if values[factor].kind is Kind.CONST:
                    size = abs(values[factor].initial) * share
                    yield number, math.ldexp(size, values[number].frac + self._power(op, term))

    def _power(self, op: Op, term: Term) -> int:
        """The power of two that the product of a term's words is counted in."""
        return -term.shift - self.program.arithmetic.guard - self.program.values[op.dest].frac

    def _is_whole(self, op: Op) -> bool:
        """Whether no term of a sum was too small for its word."""
        pairs = [(self.values[t.a], self.values[t.b], self._power(op, t)) for t in op.terms]
        size = sum(math.ldexp(_size(a) * _size(b), a.frac + b.frac + p) for a, b, p in pairs)
        return size >= _size(self.nodes[op.dest])


def _size(x: Value | Node) -> float:
    return max(abs(x.low), abs(x.high))
