"""Operations that raise a flag for input words beyond their declared ranges.

The words of a range are stretched to all words, so that only those beyond it overflow::

    q = floor((half + sum) / 2^G)          beyond: q does not fit W bits

    sum = floor(|x| c / 2^s)               of a range like [-h, h]: one slot
    sum = floor(x c / 2^s), if x > 0       of a range that begins with the first word, likewise
    sum = floor(x c / 2^s) + w 2^k         of others: two slots
    sum = (x + w) 2^G                      of each end, where no c of W bits does it

A sum never falls as x, or its magnitude, grows: the words at and behind both ends show that the
flag is exact.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Term, Value, When


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
    """``program`` with operations that watch these inputs."""
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
