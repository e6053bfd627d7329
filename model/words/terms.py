"""Symbolic words: what a program computes, as terms over its inputs, parameters and states.

Each distinct term is stored once and has a number, so two words with the same number are equal
for all inputs. The microcode is executed on such numbers (`gateware.microcode.validation`) and
compared with `Meaning`: the results of the program's operations (`model.words.fixed`).

Equal are sums with the same terms in any order, products with exchanged factors, and a word and its
copy (`gateware.schedule.slots`: a word times 2^k, shifted right by k - G, rounded). A sum without
terms is 0. The order of a sum does not matter because the accumulator is exact modulo
2^`Arithmetic.acc_width`, and the compiler has proven that no sum exceeds it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import ALWAYS, NEVER, Condition, Kind, Program, Scale, total_of


class Refuted(Exception):
    """A translation does not compute what its program says: a bug of the compiler."""


class Terms:
    """Numbers of terms, a domain of `model.words.program.total_of`; a term has one number.

    The widths of ``arithmetic`` decide which products are copies.
    """

    def __init__(self, arithmetic: Arithmetic) -> None:
        self.arithmetic = arithmetic
        self._numbers: dict[tuple[Any, ...], int] = {}
        self._terms: list[tuple[Any, ...]] = []

    def _number(self, *term: Any) -> int:
        number = self._numbers.setdefault(term, len(self._terms))
        if number == len(self._terms):
            self._terms.append(term)
        return number

    def symbol(self, name: str, number: int = 0) -> int:
        """A word that may have any value; the same name and number are the same word."""
        return self._number("symbol", name, number)

    def word(self, value: int) -> int:
        return self._number("word", value)

    def value(self, number: int) -> int | None:
        """Value of a constant; None for any other term."""
        kind, *parts = self._terms[number]
        return cast(int, parts[0]) if kind == "word" else None

    def fraction(self, word: int) -> int:
        return self._number("fraction", word)

    def sign(self, word: int, *, quarter: bool) -> int:
        return self._number("sign", word, quarter)

    def count(self, word: int) -> int:
        return self._number("count", word)

    def index(self, word: int, *, quarter: bool) -> int:
        return self._number("index", word, quarter)

    def coefficient(self, block: int, coefficient: int, index: int) -> int:
        return self._number("table", block, coefficient, index)

    def product(self, a: int, b: int) -> int:
        return self._number("product", *sorted((a, b)))

    def amount(self, shift: int, scale: Scale = Scale.NONE, count: int | None = None) -> int:
        if scale is Scale.NONE:
            return self.word(shift)
        return self._number("amount", shift, scale.value, count)

    def shifted(self, product: int, amount: int) -> int:
        return self._number("shifted", product, amount)

    def total(
        self, total: int | None, shifted: int, negate: Condition[int], take: Condition[int]
    ) -> int:
        before: tuple[Any, ...] = ()
        if total is not None:
            kind, *parts = self._terms[total]
            before = tuple(parts) if kind == "total" else (total,)
        if take == NEVER:
            return self._number("total", *before)
        term = self._number("term", shifted, negate, take)
        return self._number("total", *sorted((*before, term)))

    def result(self, total: int, *, wrap: bool) -> int:
        """Word of a sum: modulo 2^W, or clamped."""
        copied = self._copied(total)
        return self._number("wrap" if wrap else "clamp", total) if copied is None else copied

    def may_overflow(self, number: int) -> bool:
        """Whether the word is a clamped or wrapped sum, which may raise a flag."""
        return self._terms[number][0] in ("clamp", "wrap")

    def _copied(self, total: int) -> int | None:
        """The word whose copy the sum is, 0 of no terms; None for any other sum."""
        _, *parts = self._terms[total]
        if not parts:
            return self.word(0)
        if len(parts) != 1 or self._terms[parts[0]][0] != "term":  # a symbol has two parts
            return None
        _, shifted, negate, take = self._terms[parts[0]]
        kind, *operands = self._terms[shifted]
        if kind != "shifted" or (negate, take) != (NEVER, ALWAYS):
            return None
        product, amount = operands
        kind, *factors = self._terms[product]
        shift = self.value(amount)
        if kind != "product" or shift is None:
            return None
        for word, factor in (factors, reversed(factors)):
            if self.value(factor) == 1 << (shift + self.arithmetic.guard):
                return cast(int, word)
        return None

    def text(self, number: int) -> str:
        """A term, for messages."""
        kind, *parts = self._terms[number]
        return f"{kind}({', '.join(map(str, parts))})"


@dataclass(frozen=True)
class Meaning:
    """Results of a program in one update, for all inputs, parameters and states.

    ``values``: the term of each value, by its number. ``flagged``: terms of the results that raise
    a flag when they overflow: clamped words the saturation flag, words modulo 2^W that of inputs
    beyond their ranges.
    """

    values: tuple[int, ...]
    flagged: frozenset[int]

    @classmethod
    def of(cls, program: Program, terms: Terms, symbols: Mapping[int, int]) -> Meaning:
        """Meaning of a program; ``symbols`` are the terms of inputs, parameters and states."""
        values = dict(symbols)
        for number in program.of_kind(Kind.CONST):
            values[number] = terms.word(program.values[number].initial)
        flagged = set()
        for op in program.ops:
            total = total_of(op, values.__getitem__, terms)
            values[op.dest] = terms.result(total, wrap=op.overflow.wraps)
            if op.overflow.is_sticky and terms.may_overflow(values[op.dest]):
                flagged.add(values[op.dest])  # not a copy, which always fits
        return cls(tuple(values[n] for n in range(len(program.values))), frozenset(flagged))
