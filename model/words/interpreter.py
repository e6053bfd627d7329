"""Interpreters of a program: on integers, bit by bit, and on terms, for all integers.

`Interpreter` computes many independent runs at once in numpy. `Meaning` computes symbolic words,
terms over inputs, parameters and states. Each distinct term is stored once and has a number, so two
words with the same number are equal for all inputs. The microcode is executed on such numbers
(`gateware.microcode.validation`) and compared with them.

Equal are sums with the same terms in any order, products with exchanged factors, and a word and its
copy (`gateware.schedule.slots`: a word times 2^k, shifted right by k - G, rounded). A sum without
terms is 0. The order of a sum does not matter because the accumulator is exact modulo
2^`Arithmetic.acc_width`, and the compiler has proven that no sum exceeds it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import BoolArray
from boresight.model.words.fixed import Arithmetic, IntArray, leading_sign_count, saturate
from boresight.model.words.program import (
    ALWAYS,
    NEVER,
    Condition,
    Kind,
    Overflow,
    Program,
    Scale,
    total_of,
)

#: ``update(words, table_memory)`` replaces the words of the operations in the list of all words by
#: value number, and returns which of them saturated (`_clamps`).
Update = Callable[[list[Any], Any], list[Any]]

#: Number of runs up to which plain integers are faster than arrays.
FEW = 16


class Interpreter:
    """Interpreter of a `Program`, bit by bit as the core; ``runs`` independent runs side by side.

    ``values``: every word of the last update by value number, int64 (runs,), of states the words
    *before* it. ``params``: words by value number; assign to change. ``saturations``: of each value
    since the start, over all runs.
    """

    def __init__(self, program: Program, runs: int = 1) -> None:
        self.program, self.runs = program, runs
        self.params = {n: program.values[n].initial for n in program.of_kind(Kind.PARAM)}
        initial = [np.full(runs, v.initial, dtype=np.int64) for v in program.values]
        self.values: list[IntArray] = initial
        self.saturations = np.zeros(len(program.values), dtype=np.int64)
        self._tables = np.array(program.table_memory, dtype=np.int64)
        self._previous_states = [self.values[n] for n, _ in program.states]
        self._clamps = np.array(_clamps(program), dtype=np.int64)
        self._update: Update | None = None  # made at its first use

    def update(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray]:
        """Run one update on words (n_inputs, runs), in stream order.

        Returns output words (n_outputs, runs), and whether a `SAT` operation clamped, bool (runs,).
        ValueError: a wrong shape, or a word or parameter that is no integer that fits.
        """
        p, shape = self.program, (len(self.program.inputs), self.runs)
        words, params = np.asarray(inputs), np.array([*self.params.values()], dtype=object)
        if words.dtype.kind not in "iu" or words.shape != shape:
            raise ValueError(f"inputs must be integers of shape {shape}, not {words!r}")
        low, high = p.arithmetic.min_int, p.arithmetic.max_int
        if any(((a < low) | (a > high)).any() for a in (words, params)):
            raise ValueError(f"inputs and parameters must fit {p.arithmetic.word} bits")
        for number, word in zip(p.inputs, words.astype(np.int64), strict=True):
            self.values[number] = word
        for number, param in self.params.items():
            self.values[number] = np.full(self.runs, param, dtype=np.int64)
        if self._update is None:
            self._update = compiled(p, arrays=self.runs > FEW)
        if self.runs > FEW:
            clamped = np.array(self._update(self.values, self._tables), dtype=np.bool_)
        else:  # in plain integers, run by run
            words_of_runs = np.stack(self.values).T.tolist()
            by_run = [self._update(run, p.table_memory) for run in words_of_runs]
            self.values = list(np.array(words_of_runs, dtype=np.int64).T.copy())
            clamped = np.array(by_run, dtype=np.bool_).T
        clamped = clamped.reshape(-1, self.runs)
        self.saturations[self._clamps] += np.count_nonzero(clamped, axis=1)
        outputs = np.stack([self.values[n] for n in p.outputs])
        self._previous_states = [self.values[n] for n, _ in p.states]
        self.states = [self.values[n] for _, n in p.states]
        return outputs, np.any(clamped, axis=0)

    def run(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray]:
        """Run many updates: ``inputs`` (steps, n_inputs, runs).

        Returns outputs (steps, n_outputs, runs) and saturated (steps, runs).
        """
        words = np.asarray(inputs)
        out = np.empty((len(words), len(self.program.outputs), self.runs), dtype=np.int64)
        sat = np.empty((len(words), self.runs), dtype=np.bool_)
        for k, row in enumerate(words):
            out[k], sat[k] = self.update(row)
        return out, sat

    @property
    def states(self) -> IntArray:
        """Words of the states that the next update reads, (n_states, runs); assign to change."""
        words = [self.values[state] for state, _ in self.program.states]
        return np.array(words, dtype=np.int64).reshape(len(words), self.runs)

    @states.setter
    def states(self, words: Iterable[IntArray]) -> None:
        for (state, _), word in zip(self.program.states, words, strict=True):
            self.values[state] = word

    def values_before_commit(self) -> list[IntArray]:
        """`values` of the last update, with the states that it read instead of the next states."""
        words = list(self.values)
        for (state, _), word in zip(self.program.states, self._previous_states, strict=True):
            words[state] = word
        return words


class _Text:
    """Python that computes an update, of plain integers or arrays: a domain of `total_of`."""

    def __init__(self, program: Program, arrays: bool) -> None:
        arith = program.arithmetic
        self.arith, self.half = arith, 1 << (arith.word - 1)
        self.lines = ["def update(v, table):"]
        low, high = arith.min_int, arith.max_int
        limited = f"q if {low} <= q <= {high} else {low} if q < 0 else {high}"  # arrays have no if
        results = {op.dest for op in program.ops}
        self.add(*(f"v{n} = v[{n}]" for n in range(len(program.values)) if n not in results))
        for op in program.ops:
            total, word = total_of(op, "v{}".format, self), f"v{op.dest}"
            self.add(f"q = ({total}) >> {arith.guard}")
            if op.overflow.wraps:
                self.add(f"{word} = {self.wrapped('q')}")
            else:
                self.add(f"{word} = {'limited(q)' if arrays else limited}")
            if op.overflow is Overflow.SAT:
                self.add(f"c{op.dest} = {word} != q")
        self.add(*(f"v[{n}] = v{n}" for n in sorted(results)))
        self.add(f"return [{', '.join(f'c{n}' for n in _clamps(program))}]")

    def add(self, *lines: str) -> None:
        self.lines += [f" {line}" for line in lines]

    def wrapped(self, q: str) -> str:
        return f"(({q} + {self.half} & {2 * self.half - 1}) - {self.half})"

    def fraction(self, word: str) -> str:
        return f"({word} & {(1 << self.arith.fraction_bits) - 1})"

    def sign(self, word: str, *, quarter: bool) -> str:
        """A mask: -1 where the bit is set."""
        self.add(f"f = {self.wrapped(f'{word} + {self.half // 2}') if quarter else word} >> 63")
        return "f"

    def count(self, word: str) -> str:
        self.add(f"n = count({word})")
        return "n"

    def index(self, word: str, *, quarter: bool) -> str:
        moved = f"{word} + {self.half // 2}" if quarter else word
        self.add(f"i = (({moved}) >> {self.arith.fraction_bits} & 127) * 4")
        return "i"

    def coefficient(self, block: int, coefficient: int, index: str) -> str:
        return f"table[{index} + {512 * block + coefficient}]"

    def product(self, a: str, b: str) -> str:
        return f"{a} * {b}"

    def amount(self, shift: int, scale: Scale, count: str | None) -> str:
        if scale is Scale.NONE:
            return f"{shift}"
        part = {Scale.FULL: count, Scale.EVEN: f"({count} & ~1)", Scale.HALF: f"({count} >> 1)"}
        self.add(f"d = {shift} - {part[scale]}")
        return "(d & ~(d >> 63))"

    def shifted(self, product: str, amount: str) -> str:
        return f"({product} >> {amount})"

    def total(
        self, total: str | None, shifted: str, negate: Condition[str], take: Condition[str]
    ) -> str:
        for operation, (bit, flag) in (("({0} ^ {1}) - {1}", negate), ("{0} & {1}", take)):
            if flag is not None:
                shifted = f"({operation.format(shifted, f'~{flag}' if bit else flag)})"
        total = f"{1 << (self.arith.guard - 1)}" if total is None else total
        self.add(f"q = {total} {'-' if negate == (True, None) else '+'} {shifted}")
        return "q"


def _clamps(program: Program) -> list[int]:
    """Values whose operations saturate, in order."""
    return [op.dest for op in program.ops if op.overflow is Overflow.SAT]


def compiled(program: Program, *, arrays: bool) -> Update:
    """The operations of a program as a function, of plain integers or of arrays of runs."""
    return _compiled("\n".join(_Text(program, arrays).lines), program.arithmetic, arrays)


@lru_cache(maxsize=64)
def _compiled(text: str, arith: Arithmetic, arrays: bool) -> Update:
    def count(x: int) -> int:
        return min(arith.norm_max, arith.word - 1 - (x if x >= 0 else ~x).bit_length())

    names: dict[str, Any] = {"count": count}
    if arrays:
        names["limited"] = partial(saturate, word=arith.word)
        names["count"] = partial(leading_sign_count, arith=arith)
    exec(compile(text, "<program>", "exec"), names)
    update: Update = names["update"]
    return update


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
