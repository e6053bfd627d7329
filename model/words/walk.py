"""The walk over an operation, for every domain that computes it.

`total` is the definition of `model.words.fixed` in steps. A domain says what each step is:
`model.words.interpreter` text in Python, for integers and arrays of them, and `model.words.terms`
symbolic words.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from boresight.model.words.program import Negate, Op, When

W = TypeVar("W")
#: (bit, flag): the bit, exclusive-or the flag where there is one.
Condition = tuple[bool, W | None]
NEVER: tuple[bool, None] = (False, None)
ALWAYS: tuple[bool, None] = (True, None)

#: The bit, and whether the flag counts.
_NEGATE = {Negate.NO: (False, False), Negate.YES: (True, False)}
_NEGATE |= {Negate.IF: (False, True), Negate.UNLESS: (True, True)}
_WHEN = {When.ALWAYS: (True, False), When.IF: (False, True), When.UNLESS: (True, True)}


def total(op: Op, words: Callable[[int], W], domain: Any) -> W:
    """Sum of an operation: ``2^(G-1) + sum_k sign_k * floor(a_k * b_k / 2^s_k)``.

    Parameters
    ----------
    op : Op
    words : callable
        Word of a value, by its number.
    domain : object
        Its methods are ``fraction(word)``, the bits below the segment index; ``sign``, ``index``
        of a word, or with ``quarter`` of the word plus a quarter of the range; the normalisation
        ``count(word)``; ``coefficient(block, coefficient, index)`` of the table memory;
        ``product``; ``amount(shift, scale, count)``, the shift less a part of the count, not below
        0; ``shifted(product, amount)``; ``total(sum or None, shifted, negate, take)``, the sum
        (None: the rounding half) and a term that is subtracted under ``negate`` and takes part
        under ``take``.
    """
    flag = None if op.flag is None else domain.sign(words(op.flag), quarter=op.flag_quarter)
    count = None if op.norm is None else domain.count(words(op.norm))
    index = None if op.index is None else domain.index(words(op.index), quarter=op.index_quarter)
    result: W | None = None
    for term in op.terms:
        a = domain.fraction(words(term.a)) if term.fraction_a else words(term.a)
        if term.b is None:
            assert op.table is not None and term.coefficient is not None and index is not None
            b = domain.coefficient(op.table, term.coefficient, index)
        else:
            b = domain.fraction(words(term.b)) if term.fraction_b else words(term.b)
        amount = domain.amount(term.shift, term.scale, count)
        negate, take = (
            (bit, flag if flagged else None)
            for bit, flagged in (_NEGATE[term.negate], _WHEN[term.when])
        )
        result = domain.total(result, domain.shifted(domain.product(a, b), amount), negate, take)
    assert result is not None
    return result
