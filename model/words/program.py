"""The fixed-point program that interpreter, C and core execute.

A program is a list of *values* (words with a binary point and a name) and a list of *operations*
in executable order. Every operation is one multiply-accumulate group (`model.words.fixed`);
functions are already expanded into such groups on tables. One update reads the inputs, runs every
operation once, emits the outputs and replaces the states.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import cache, cached_property
from typing import Any, TypeVar, cast

import numpy as np

from boresight.model.arrays import BoolArray
from boresight.model.words.fixed import Arithmetic, Format, IntArray


class Kind(StrEnum):
    """Origin of a value."""

    INPUT = "input"  #: one word of the input stream, new at every update
    PARAM = "param"  #: a register that the host may write between updates
    STATE = "state"  #: carried from update to update
    CONST = "const"  #: fixed when the program is compiled
    OP = "op"  #: result of an operation


class Overflow(StrEnum):
    """Treatment of a result beyond the word (names of ap_fixed)."""

    SAT = "SAT"  #: clamp, and raise the sticky saturation flag
    CLIP = "CLIP"  #: clamp by declaration, without a flag
    WRAP = "WRAP"  #: modulo 2^W: binary angles
    RANGE = "RANGE"  #: modulo 2^W; raise the sticky flag of an input beyond its declared range

    @property
    def wraps(self) -> bool:
        """Whether the result is modulo 2^W, else clamped."""
        return self in (Overflow.WRAP, Overflow.RANGE)

    @property
    def is_sticky(self) -> bool:
        """Whether a flag is raised where the result does not fit."""
        return self in (Overflow.SAT, Overflow.RANGE)


class Negate(StrEnum):
    """Sign of a term. The flag is the sign bit of `Op.flag`."""

    NO = "no"
    YES = "yes"
    IF = "if"  #: minus when the flag is set
    UNLESS = "unless"  #: minus when the flag is clear


class When(StrEnum):
    """Condition under which a term is added."""

    ALWAYS = "always"
    IF = "if"  #: only when the flag is set
    UNLESS = "unless"  #: only when the flag is clear


class Scale(StrEnum):
    """Part of the normalisation count n of `Op.norm` that is subtracted from a term's shift."""

    NONE = "none"
    FULL = "full"  #: n
    EVEN = "even"  #: n with its lowest bit cleared
    HALF = "half"  #: floor(n / 2)


@dataclass(frozen=True)
class Value:
    """A named word.

    ``low`` and ``high`` bound it in real units; ``range_source`` is the origin of the bounds.
    ``initial`` is the word of a constant, the reset word of a state, the default of a parameter.
    """

    name: str
    kind: Kind
    frac: int
    low: float
    high: float
    range_source: str
    unit: str = ""
    initial: int = 0
    meaning: str = ""


@dataclass(frozen=True)
class Term:
    """One product of an operation: ``sign * floor(a * b / 2^shift)``.

    ``a`` is a value. ``b`` is a value, or None when ``coefficient`` (0..3) names a word of the
    operation's table segment. ``fraction_a``/``fraction_b`` replace the word by its bits below the
    segment index.
    """

    a: int
    b: int | None
    shift: int
    coefficient: int | None = None
    negate: Negate = Negate.NO
    when: When = When.ALWAYS
    fraction_a: bool = False
    fraction_b: bool = False
    scale: Scale = Scale.NONE

    @property
    def conditional(self) -> bool:
        """Whether it depends on the operation's flag."""
        return self.negate in (Negate.IF, Negate.UNLESS) or self.when is not When.ALWAYS


@dataclass(frozen=True)
class Op:
    """One multiply-accumulate group.

    ``flag``  value whose sign bit decides conditional terms; with ``flag_quarter`` the sign bit of
              that word plus a quarter of the word's range.
    ``norm``  value whose leading-sign count scales terms.
    ``index`` value whose segment index addresses ``table`` (with ``index_quarter`` likewise).
    ``table`` block of the table memory: word address = 512 * table + 4 * index + coefficient.
    """

    dest: int
    terms: tuple[Term, ...]
    overflow: Overflow = Overflow.SAT
    flag: int | None = None
    flag_quarter: bool = False
    norm: int | None = None
    index: int | None = None
    index_quarter: bool = False
    table: int | None = None

    def operands(self) -> Iterator[int]:
        """Every value the operation reads (with repeats)."""
        read = [v for term in self.terms for v in (term.a, term.b)]
        yield from (v for v in (*read, self.flag, self.norm, self.index) if v is not None)


@dataclass(frozen=True)
class Port:
    """Description of an output; without effect on the hardware.

    ``tolerance`` is the largest accepted difference from float64, in ``unit``.
    """

    name: str
    unit: str = ""
    tolerance: float | None = None
    meaning: str = ""


@dataclass(frozen=True)
class InPort:
    """Description of an input; without effect on the hardware.

    ``missing`` is the value read where the source has no new sample ("hold": the last one; None:
    every record has one), ``flags`` the inputs whose validity it flags, if it is a flag.
    """

    missing: float | str | None = None
    flags: tuple[str, ...] = ()
    meaning: str = ""


@dataclass(frozen=True)
class Program:
    """A compiled estimator.

    ``inputs`` and ``outputs`` list values in stream order; ``states`` maps each state value to the
    value that replaces it at the end of an update (possibly itself). ``table_memory`` is the flat
    function table (W-bit words, a multiple of 512). ``in_ports`` and ``ports`` describe inputs and
    outputs; ``urgent`` is the number of leading outputs whose latency counts first (None: all);
    none of them is part of the `digest`.
    """

    name: str
    arithmetic: Arithmetic
    values: tuple[Value, ...]
    ops: tuple[Op, ...]
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]
    output_names: tuple[str, ...]
    states: tuple[tuple[int, int], ...]
    table_memory: tuple[int, ...]
    ports: tuple[Port, ...] = ()
    urgent: int | None = None
    in_ports: tuple[InPort, ...] = ()

    @cached_property
    def fracs(self) -> IntArray:
        """Bits behind the binary point of every value, (n_values,)."""
        return np.array([value.frac for value in self.values])

    def format(self, value: int) -> Format:
        return Format(self.arithmetic.word, self.values[value].frac)

    def find(self, name: str) -> int:
        """Number of the value called ``name``; raises KeyError for an unknown name."""
        return {value.name: n for n, value in enumerate(self.values)}[name]

    @cached_property
    def input_ranges(self) -> IntArray:
        """Least and largest word of every input, (2, n_inputs); of one not watched, of any."""
        watched = {op.terms[0].a for op in self.ops if op.overflow is Overflow.RANGE}
        every = self.arithmetic.min_int, self.arithmetic.max_int
        values = [(n, self.values[n]) for n in self.inputs]
        ends = [
            self.format(n).quantise((v.low, v.high)) if n in watched else every for n, v in values
        ]
        return np.array(ends, dtype=np.int64).reshape(-1, 2).T

    def beyond(self, words: IntArray) -> BoolArray:
        """Whether a word of a record (..., n_inputs) is beyond its declared range, (...)."""
        low, high = self.input_ranges
        return cast(BoolArray, ((words < low) | (words > high)).any(axis=-1))

    def of_kind(self, kind: Kind) -> list[int]:
        return [n for n, v in enumerate(self.values) if v.kind is kind]

    @cached_property
    def digest(self) -> str:
        """SHA-256 that identifies the program in reports and in the core's build register.

        It covers the hardware's behaviour (arithmetic, operations, binary points, table, first
        words) and the meaning of its ports (names, units, declared ranges), but not the names and
        derived ranges of values in between.
        """
        content = {**_record(self), "values": [_identity(v) for v in self.values]}
        for documentation in ("in_ports", "ports", "urgent"):
            del content[documentation]
        return hashlib.sha256(json.dumps(content, default=_record).encode()).hexdigest()


@cache
def _names(record_type: type) -> tuple[str, ...]:
    return tuple(sorted(f.name for f in fields(record_type)))


def _record(x: Any) -> dict[str, Any]:
    """A dataclass for JSON, keys in order."""
    record_type: Any = type(x)
    return {name: getattr(x, name) for name in _names(record_type)}


def _identity(value: Value) -> list[Any]:
    """Part of a value that the digest covers; more of what is read or written from outside."""
    identity = [value.kind.value, value.frac, value.initial]
    if value.kind in (Kind.OP, Kind.CONST):
        return identity
    return [*identity, value.name, value.unit, float(value.low), float(value.high)]


W = TypeVar("W")
#: (bit, flag): the bit, exclusive-or the flag where there is one.
Condition = tuple[bool, W | None]
NEVER: tuple[bool, None] = (False, None)
ALWAYS: tuple[bool, None] = (True, None)

#: By the text of `Negate` and `When`: the bit, and whether the flag counts.
_CONDITIONS = {"no": (False, False), "yes": (True, False), "always": (True, False)}
_CONDITIONS |= {"if": (False, True), "unless": (True, True)}


def total_of(op: Op, words: Callable[[int], W], domain: Any) -> W:
    """Sum of an operation: ``2^(G-1) + sum_k sign_k * floor(a_k * b_k / 2^s_k)``.

    ``words`` gives the word of a value by its number. The methods of ``domain`` are
    ``fraction(word)``, the bits below the segment index; ``sign``, ``index`` of a word, or with
    ``quarter`` of the word plus a quarter of the range; the normalisation ``count(word)``;
    ``coefficient(block, coefficient, index)`` of the table memory; ``product``; ``amount(shift,
    scale, count)``, the shift less a part of the count, not below 0; ``shifted(product, amount)``;
    ``total(sum or None, shifted, negate, take)``, the sum (None: the rounding half) and a term that
    is subtracted under ``negate`` and takes part under ``take``.
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
        pairs = (_CONDITIONS[term.negate], _CONDITIONS[term.when])
        negate, take = ((bit, flag if flagged else None) for bit, flagged in pairs)
        result = domain.total(result, domain.shifted(domain.product(a, b), amount), negate, take)
    assert result is not None
    return result
