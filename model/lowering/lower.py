"""Lowering: from the recorded step to the fixed-point program.

`model.lowering.graph` expands functions and finds intervals, `model.lowering.fuse` makes words and
operations; what nothing needs is left out here.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from boresight.model.lowering.fuse import Fusion
from boresight.model.lowering.graph import LEAVES, Flag, Graph, Node, expand
from boresight.model.lowering.groups import Groups, Product
from boresight.model.lowering.profile import Profile, Range
from boresight.model.lowering.trace import Trace
from boresight.model.words import tables
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import (
    Kind,
    Negate,
    Op,
    Overflow,
    Program,
    Scale,
    Term,
    Value,
    When,
)
from boresight.model.words.rounded import binary_exponent, sum_of

#: Calls that one node may take while it is lowered.
_CALLS = 8
#: Kinds of nodes whose formats are prescribed.
_PRESCRIBED = (*LEAVES, "wrap", "sin", "asin", "saturated")
#: Bits more than a state's that leave too many words on a tie.
_TIES = 6
#: Products that a copy serves at least.
FEWEST = 4
#: A product with a value of its own: that, the value of its sum, the product, and the coarser
#: factors that return it to its sum, each with a number of bits.
_Separate: TypeAlias = tuple[int, int, Product, list[tuple[int, int]]]


def _pruned(program: Program) -> tuple[Program, dict[int, int]]:
    """``program`` without unused operations and constants, and the new numbers of its values."""
    used = {*program.outputs, *(after for _, after in program.states)}
    ops: list[Op] = []
    for op in reversed(program.ops):
        if op.dest in used:
            ops.append(op)
            used.update(op.operands())
    made = (Kind.OP, Kind.CONST)
    keep = [n for n, v in enumerate(program.values) if n in used or v.kind not in made]
    new = {old: number for number, old in enumerate(keep)}

    def renumber(op: Op) -> Op:
        terms = tuple(replace(t, a=new[t.a], b=None if t.b is None else new[t.b]) for t in op.terms)
        flag, norm, index = (None if v is None else new[v] for v in (op.flag, op.norm, op.index))
        return replace(op, dest=new[op.dest], terms=terms, flag=flag, norm=norm, index=index)

    pruned = replace(
        program,
        values=tuple(program.values[n] for n in keep),
        ops=tuple(renumber(op) for op in reversed(ops)),
        inputs=tuple(new[n] for n in program.inputs),
        outputs=tuple(new[n] for n in program.outputs),
        states=tuple((new[a], new[b]) for a, b in program.states),
    )
    return pruned, new


def _count_uses(roots: Sequence[Node]) -> None:
    """Set `Node.uses`: by how many live nodes and roots each node is used."""
    visited: set[int] = set()
    stack = list(roots)
    while stack:
        node = stack.pop()
        node.uses += 1
        if node.number not in visited:
            visited.add(node.number)
            stack += node.args


def _fit(
    graph: Graph,
    expanded: Sequence[Node | Flag],
    profile: Profile,
    after: Sequence[Node],
    states: Sequence[Range],
) -> None:
    """Give nodes the ranges of a profile, for their formats; see `Node.fit`.

    Nodes inside a function, which have no expression, get the range that follows from those of
    their arguments. A next state has its state's format: see `Fusion.limit`.
    """
    recorded = [value.node if isinstance(value, Flag) else value for value in expanded]
    for number, range_ in profile.ranges.items():
        if (node := recorded[number]) not in after:
            _set_fit(node, range_, profile)
    of_expressions = {*recorded}
    for node in graph.nodes:
        if node not in of_expressions and (span := _span(node)) is not None:
            _set_fit(node, span, profile)
    _round_once(graph.nodes, after, states)


def _round_once(nodes: Sequence[Node], after: Sequence[Node], states: Sequence[Range]) -> None:
    """Words that are copied or added into a next state get no format a few bits finer than its own.

    Rounded to the state's format a second time, a share 2^-k of the words with k bits more lies on
    a tie and goes up: in each update the state creeps by 2^-(k + 1) of its last bit.
    """
    for root, (state_low, state_high) in zip(after, states, strict=True):
        top = math.ldexp(1.0, binary_exponent(_size((state_low, state_high))))
        reached = {root}
        for node in reversed(nodes):  # after all that use it
            if node not in reached or node.kind not in ("select", "bounded", "sum"):
                continue
            for arg in node.args[1:] if node.kind == "select" else node.args:
                size = _size(arg.span)
                if size >= math.ldexp(top, -_TIES):
                    reached.add(arg)
                    if arg.fit is not None and size < top:
                        low, high = min(arg.fit[0], state_low), max(arg.fit[1], state_high)
                        arg.fit = max(arg.low, low), min(arg.high, high)


def _size(range_: Range) -> float:
    return max(abs(end) for end in range_)


def _set_fit(node: Node, range_: Range, profile: Profile) -> None:
    low, high = max(range_[0], node.low), min(range_[1], node.high)
    if node.kind not in _PRESCRIBED and low < high and (low, high) != (node.low, node.high):
        node.fit, node.source = (low, high), profile.source


def _span(node: Node) -> Range | None:
    """Range of a node whose arguments stay in their spans; None: unknown."""
    spans = [arg.span for arg in node.args]
    if node.kind == "sum":
        ends = [sorted((k * a, k * b)) for (a, b), k in zip(spans, node.signs, strict=True)]
        return sum_of(low for low, _ in ends), sum_of(high for _, high in ends)
    if node.kind == "mul":
        corners = [x * y for x in spans[0] for y in spans[1]]  # of infinities: infinite or NaN
        return min(corners), max(corners)
    if node.kind == "select":
        return min(low for low, _ in spans[1:]), max(high for _, high in spans[1:])
    if node.kind == "abs":  # as fine as its argument, or it is 0 where that is not
        low, high = spans[0]
        return max(0.0, low, -high), max(high, -low)
    return None


def lower(
    trace: Trace, arithmetic: Arithmetic, profile: Profile | None = None
) -> tuple[Program, dict[int, Node]]:
    """Compile a recorded step, with the formats of a profile of it.

    Returns the program, without ports, and the node of each of its values that holds one.
    InputError: an argument's range exceeds what its function takes, a range is not finite, or a
    term passes the accumulator; with the line, the value and a cure.
    """
    graph, expanded = expand(trace.tracer, profile.limits if profile else None, arithmetic)
    low = Fusion(graph, arithmetic)
    results = [expanded[e.number] for e in trace.outputs.values()]
    after = [expanded[e.number] for _, _, e in trace.states]
    if profile is not None:
        _fit(graph, expanded, profile, after, [e.data[2:4] for e, _, _ in trace.states])
    for (state, _, _), node in zip(trace.states, after, strict=True):
        if profile is not None and math.isinf(_size((node.low, node.high))):
            node.fit = state.data[2:4]
        node.title = node.title or f"{state.data[1]}_next"
    leaves = {node.name for node in graph.nodes if node.kind in LEAVES}
    for name, node in zip(trace.outputs, results, strict=True):
        node.title = node.title or (f"{name}_out" if name in leaves else name)
    _count_uses([*results, *after])
    inputs = tuple(
        low.leaf(expanded[e.number], frac=trace.fracs.get(e.data[1])) for e in trace.inputs
    )
    for e, default, meaning in trace.params:
        low.leaf(expanded[e.number], default, meaning)
    states = [low.leaf(expanded[e.number], initial) for e, initial, _ in trace.states]
    for number, node in zip(states, after, strict=True):
        low.limit(node, number)
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(limit + _CALLS * len(graph.nodes))  # as deep as a chain of them
    try:
        outputs = tuple(low.word(node) for node in results)
        replaced = tuple((s, low.replacing(node, s)) for s, node in zip(states, after, strict=True))
    finally:
        sys.setrecursionlimit(limit)
    share(low.groups)
    whole = Program(
        graph.name,
        arithmetic,
        inputs=inputs,
        outputs=outputs,
        output_names=tuple(trace.outputs),
        states=replaced,
        values=tuple(low.groups.values),
        ops=tuple(low.groups.ops),
        table_memory=tables.table_memory(arithmetic),
    )
    program, new = _pruned(whole)
    return program, {new[n]: node for node in graph.nodes for n in low.holders(node) if n in new}


def share(groups: Groups) -> None:
    """Take products back into their sums where `FEWEST` or more share a coarser factor."""
    candidates = [*_separate_products(groups)]
    while candidates:
        [(copy, count)] = Counter(c for *_, copies in candidates for c in copies).most_common(1)
        if count < FEWEST:
            break
        _merge(groups, *copy, [a for a in candidates if copy in a[3]])
        candidates = [a for a in candidates if copy not in a[3]]


def _separate_products(groups: Groups) -> Iterator[_Separate]:
    """Products of two words that have values of their own and are added once."""
    readers: dict[int, list[int]] = {}
    for op in groups.ops:
        for operand in op.operands():
            if operand in groups.separate_products:
                readers.setdefault(operand, []).append(op.dest)
    for number, p in groups.separate_products.items():
        sums = readers.get(number, [])
        if len(sums) == 1 and p.b is not None and p.scale is Scale.NONE:
            excess = groups.excess(p, groups.frac(p.b), groups.frac(sums[0]))
            if excess > 0:
                bits = excess + excess % 2  # an even number of bits is removed
                yield number, sums[0], p, sorted({(p.a, bits), (p.b, bits)})


def _merge(groups: Groups, factor: int, bits: int, candidates: list[_Separate]) -> None:
    """Exchange what the sums add for products with a copy of ``factor``, made before the first."""
    before = len(groups.ops)
    copy = groups.coarse(factor, bits)
    copy_ops = groups.ops[before:]
    del groups.ops[before:]
    place = {op.dest: k for k, op in enumerate(groups.ops)}
    first = before
    for number, of, p, _ in candidates:
        k = place[of]
        coarser = replace(p, a=copy) if p.a == factor else replace(p, b=copy)
        terms = groups.forms[of].products
        op = groups.exchanged(groups.ops[k], [coarser if t.a == number else t for t in terms])
        if op is not None:
            groups.ops[k] = op
            first = min(first, k)
    groups.ops[first:first] = copy_ops


@dataclass(frozen=True)
class _Sum:
    """``x factor / 2^shift`` under conditions of its sign, and words w with powers k: w 2^k."""

    factor: int
    shift: int
    negate: Negate = Negate.NO
    when: When = When.ALWAYS
    offset: tuple[tuple[int, int], ...] = ()

    def of(self, x: int) -> int:
        """The sum of a word, in bits of the accumulator."""
        if self.when is not When.ALWAYS and (x < 0) != (self.when is When.IF):
            return 0
        product = self.factor * x >> self.shift
        product = -product if self.negate is Negate.IF and x < 0 else product
        return product + sum(word << power for word, power in self.offset)


def watched(program: Program, inputs: Iterable[int]) -> Program:
    """``program`` with operations that raise a flag for words of these inputs beyond their ranges.

    The words of a range are stretched to all words, so that only those beyond it overflow::

        q = floor((half + sum) / 2^G)          beyond: q does not fit W bits

        sum = floor(|x| c / 2^s)               of a range like [-h, h]: one slot
        sum = floor(x c / 2^s), if x > 0       of a range that begins with the first word, likewise
        sum = floor(x c / 2^s) + w 2^k         of others: two slots
        sum = (x + w) 2^G                      of each end, where no c of W bits does it

    A sum never falls as x, or its magnitude, grows: the words at and behind both ends show that the
    flag is exact.
    """
    values, ops = list(program.values), list(program.ops)
    names = {value.name for value in values}
    words = {v.initial: n for n, v in enumerate(values) if v.kind is Kind.CONST}

    def value(name: str, kind: Kind, low: float, high: float, word: int = 0) -> int:
        while name in names:
            name += "_"
        names.add(name)
        values.append(Value(name, kind, 0, low, high, "range of an input", initial=word))
        return len(values) - 1

    def constant(word: int) -> int:
        if word not in words:
            words[word] = value(f"const_{word}", Kind.CONST, word, word, word)
        return words[word]

    def term(word: int, power: int) -> Term:
        usable = (k for k in range(power, program.arithmetic.word - 1) if 1 << k in words)
        unit = next(usable, power)
        return Term(constant(word), constant(1 << unit), unit - power)

    for number in inputs:
        of, form = values[number], program.format(number)
        low, high = (int(form.quantise(end)) for end in (of.low, of.high))
        for s in _sums(program.arithmetic, low, high):
            x = Term(number, constant(s.factor), s.shift, None, s.negate, s.when)
            dest = value(f"{of.name}_beyond", Kind.OP, form.min, form.max)
            terms = (x, *(term(*part) for part in s.offset))
            flag = number if x.conditional else None
            ops.append(Op(dest, terms, Overflow.RANGE, flag=flag))
    return replace(program, values=tuple(values), ops=tuple(ops))


def _sums(arith: Arithmetic, low: int, high: int) -> Iterator[_Sum]:
    """Sums that overflow for words outside ``low`` to ``high`` alone; none if all are inside."""
    first, last = arith.min_int, arith.max_int
    ends = [(end, word) for end, word in ((last, high), (first, low)) if word != end]
    found = _stretched(arith, low, high) if ends else None
    if found is not None:
        yield found
        return
    for end, word in ends:
        move, parts = end - word, list[tuple[int, int]]()
        while move:  # beyond a word if the range lies on one side of 0
            parts.append((max(first, min(last, move)), arith.guard))
            move -= parts[-1][0]
        yield _Sum(1 << arith.guard, 0, offset=tuple(parts))


def _stretched(arith: Arithmetic, low: int, high: int) -> _Sum | None:
    """The range stretched to all words; None if no factor of W bits does it."""
    first, last = arith.min_int, arith.max_int
    limit, half = 1 << (arith.word - 1 + arith.guard), 1 << (arith.guard - 1)
    bottom, top = -limit - half, limit - half  # sums from one to the other do not overflow
    room = (1 << (arith.acc_width - 2)) - half  # of the accumulator, for either part of a sum

    def nearest(size: int) -> Iterator[_Sum]:
        """Sums that stretch ``size`` words to all."""
        shift = arith.shift_max
        while shift > 0 and (2 * limit << shift) // size >= last:
            shift -= 1
        for factor in range((2 * limit << shift) // size - 1, last + 1)[:3]:
            if factor << (arith.word - 1) >> shift < room:
                yield _Sum(factor, shift)

    def exact(s: _Sum) -> bool:
        words = (low - 1, low, high, high + 1)
        fits = [bottom <= s.of(word) < top for word in words]
        return fits == [low == first, True, True, high == last]

    largest = high if low == first else -low
    for s in nearest(2 * largest + 1) if largest > 0 else ():
        if low == first:
            s = replace(s, when=When.UNLESS)
        elif high == last:
            s = replace(s, when=When.IF)
        else:
            s = replace(s, negate=Negate.IF)
        if exact(s):
            return s
    if low == first or high == last:
        return None
    for s in nearest(high - low + 1):
        least = max(top - s.of(high + 1), bottom - s.of(low))
        for power in reversed(range(arith.word - 1)):
            word = -(-least >> power)
            moved = replace(s, offset=((word, power),))
            if first <= word <= last and abs(word << power) < room and exact(moved):
                return moved
    return None
