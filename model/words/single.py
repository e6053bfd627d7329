"""One run of a program in plain integers, as generated Python.

On short arrays, the calls of numpy for each step of each term take twenty times as long as the
work. The text generated for an operation computes the same as `model.words.interpreter` on arrays;
tests compare the two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

from boresight.model.words.program import Negate, Op, Overflow, Program, Scale, Term, When

__all__ = ["Update", "single"]

#: ``update(words, table_memory)``: replaces the words of the operations in the list of all words
#: by value number, and returns the numbers of those that saturated.
Update = Callable[[list[int], tuple[int, ...]], list[int]]


#: Maximum terms of one expression; Python's compiler limits the nesting to some thousands.
_MOST = 256


def single(program: Program) -> Update:
    """The operations of a program as a function of its words."""
    return _compiled("\n".join(_Text(program).lines()))


class _Text:
    """The text of a program's function."""

    def __init__(self, program: Program) -> None:
        self.program = program
        arith = program.arithmetic
        self.quarter = 1 << (arith.word - 2)
        self.half = 1 << (arith.word - 1)
        self.mask = (1 << arith.word) - 1
        self.low = (1 << arith.fraction_bits) - 1

    def lines(self) -> Iterator[str]:
        """Yield the lines of the function."""
        results = {op.dest for op in self.program.ops}
        yield "def update(v, table):"
        yield " clamped = []"
        yield from (f" v{n} = v[{n}]" for n in range(len(self.program.values)) if n not in results)
        for op in self.program.ops:
            yield from (f" {line}" for line in self.operation(op))
        yield from (f" v[{n}] = v{n}" for n in sorted(results))
        yield " return clamped"

    def operation(self, op: Op) -> Iterator[str]:
        """Lines that compute one operation's word."""
        arith = self.program.arithmetic
        if op.flag_quarter:
            yield f"f = (v{op.flag} + {self.quarter + self.half}) & {self.mask} < {self.half}"
        elif op.flag is not None:
            yield f"f = v{op.flag} < 0"
        if op.norm is not None:
            x = f"v{op.norm}"
            yield (
                f"n = min({arith.norm_max}, "
                f"{arith.word - 1} - ({x} if {x} >= 0 else ~{x}).bit_length())"
            )
        if op.table is not None:
            x = f"(v{op.index} + {self.quarter})" if op.index_quarter else f"v{op.index}"
            segment = f"({x} >> {arith.fraction_bits} & {(1 << arith.INDEX_BITS) - 1})"
            yield f"i = {512 * op.table} + 4 * {segment}"
        terms, partial = [self.term(term) for term in op.terms], f"{1 << (arith.guard - 1)}"
        while len(terms) > _MOST:
            yield f"q = {partial}{''.join(terms[:_MOST])}"
            terms, partial = terms[_MOST:], "q"
        yield f"q = ({partial}{''.join(terms)}) >> {arith.guard}"
        if op.overflow is Overflow.WRAP:
            yield f"v{op.dest} = ((q + {self.half}) & {self.mask}) - {self.half}"
            return
        lower, upper = -self.half, self.half - 1
        yield f"v{op.dest} = q if {lower} <= q <= {upper} else {lower} if q < 0 else {upper}"
        if op.overflow is Overflow.SAT:
            yield f"if v{op.dest} != q: clamped.append({op.dest})"

    def term(self, term: Term) -> str:
        """A signed summand."""
        a = f"(v{term.a} & {self.low})" if term.fraction_a else f"v{term.a}"
        if term.coefficient is not None:
            b = f"table[i + {term.coefficient}]"
        else:
            b = f"(v{term.b} & {self.low})" if term.fraction_b else f"v{term.b}"
        counts = {Scale.FULL: "n", Scale.EVEN: "(n & ~1)", Scale.HALF: "(n >> 1)"}
        count = counts.get(term.scale)
        shift = f"{term.shift}" if count is None else f"max({term.shift} - {count}, 0)"
        text = f"({a} * {b} >> {shift})"
        signs = {
            Negate.IF: f"(-{text} if f else {text})",
            Negate.UNLESS: f"({text} if f else -{text})",
        }
        text = signs.get(term.negate, text)
        if term.when is not When.ALWAYS:
            text = f"({text} if f else 0)" if term.when is When.IF else f"(0 if f else {text})"
        return f" - {text}" if term.negate is Negate.YES else f" + {text}"


@lru_cache(maxsize=64)
def _compiled(text: str) -> Update:
    names: dict[str, Update] = {}
    exec(compile(text, "<program>", "exec"), names)
    return names["update"]
