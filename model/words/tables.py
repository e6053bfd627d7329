"""Function tables: cubic segments, evaluated by multiply-accumulate groups.

A function is tabulated over a normalised argument whose word's `Arithmetic.INDEX_BITS` bits below
the sign bit choose the segment and whose remaining bits are the position p in [0, 1) inside it::

    y = c0 + c1 p + c2 p^2 + c3 p^3 = (c0 + c1 p) + (c2 + c3 p) (p p)

Each segment interpolates the function at the four Chebyshev nodes of the segment, which is within
a few per cent of the best cubic. Coefficients are computed with `model.words.rounded.PRECISE` and
rounded once to float64; their words have one binary point per coefficient.

| table | block | segments | argument | result |
|---|---|---|---|---|
| SIN | 0 | 0..127 | x in [0, 1) half turns, word 2^(W-1) | sin(pi x) |
| RSQRT | 1 | 32..127 | m in [1/4, 1), word 2^(W-1) | m^(-1/2) |
| ASIN | 2 | 0..46 | v in [0, 0.73), word 2^(W-2) | asin(v)/pi, half turns |
| RECIPROCAL | 2 | 64..127 | m in [1/2, 1), word 2^(W-1) | 1/m |
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.words.fixed import Arithmetic, Format
from boresight.model.words.rounded import PRECISE

#: Words of one block: 128 segments of four coefficients.
BLOCK_WORDS = 512
_BLOCKS = 3


@dataclass(frozen=True)
class Table:
    """One tabulated function.

    ``function`` maps the argument (segment / ``segments_per_unit``), a number of `PRECISE`, to the
    result. Segments ``first`` to ``last`` are in use; ``result_frac_below_word`` is W minus the
    result's fraction bits; ``low``/``high`` bound the result.
    """

    name: str
    block: int
    first: int
    last: int
    segments_per_unit: int
    function: Callable[[Any], Any]
    result_frac_below_word: int
    low: float
    high: float

    def result_format(self, arith: Arithmetic) -> Format:
        return Format(arith.word, arith.word - self.result_frac_below_word)

    @cached_property
    def coefficients(self) -> FloatArray:
        """Coefficients (segments in use, 4) of 1, p, p^2, p^3, p in [0, 1); not to be written.

        The cubics through the function at the Chebyshev nodes of every segment.
        """
        nodes = [(1 - PRECISE.cospi(PRECISE.mpf(2 * k + 1) / 8)) / 2 for k in range(4)]
        # Row k: weights of node k's value in the coefficients of 1, p, p^2, p^3.
        parts = PRECISE.inverse(PRECISE.matrix([[p**power for power in range(4)] for p in nodes])).T
        values = [[self.at(s + p) for p in nodes] for s in range(self.first, self.last + 1)]
        rows = [[PRECISE.fdot(y, parts.column(k)) for k in range(4)] for y in values]
        c = np.array(rows, dtype=np.float64)
        c.setflags(write=False)
        return c

    def at(self, segment: Any) -> Any:
        """The function at the beginning of a segment; fractions lie inside segments."""
        return self.function(PRECISE.mpf(segment) / self.segments_per_unit)


SIN = Table("sin", 0, 0, 127, 128, PRECISE.sinpi, 2, 0.0, 1.0)
RSQRT = Table("rsqrt", 1, 32, 127, 128, lambda m: 1 / PRECISE.sqrt(m), 2, 1.0, 2.0)
ASIN = Table("asin", 2, 0, 46, 64, lambda v: PRECISE.asin(v) / PRECISE.pi, 1, 0.0, 0.263)
RECIPROCAL = Table("reciprocal", 2, 64, 127, 128, lambda m: 1 / m, 2, 1.0, 2.0)
TABLES = (SIN, RSQRT, ASIN, RECIPROCAL)


def part_format(table: Table, arith: Arithmetic, low: float, high: float) -> Format:
    """Format of a coefficient or a partial sum: the finest that holds its range.

    A range that ends at a power of two (1/m at m = 1/2) gives up its last bit there for one bit
    more everywhere else. No format is finer than the accumulator can use: that keeps shifts legal.
    """
    scale = 1.0 - math.ldexp(1.0, 2 - arith.word)
    fmt = Format.for_range(arith.word, low * scale, high * scale)
    return Format(arith.word, min(fmt.frac, table.result_format(arith).frac + arith.guard))


@lru_cache
def coefficient_formats(table: Table, arith: Arithmetic) -> tuple[Format, ...]:
    """Format of each of the four coefficients, common to all segments."""
    return tuple(
        part_format(table, arith, float(column.min()), float(column.max()))
        for column in table.coefficients.T
    )


@lru_cache
def table_memory(arith: Arithmetic) -> tuple[int, ...]:
    """The flat table memory: word address = 512 * block + 4 * segment + coefficient.

    Unused segments hold the value at the nearest edge of the segments in use (c0 only, saturated to
    its format), so that an argument outside the domain gives a bounded result.
    """
    memory = np.zeros((_BLOCKS, BLOCK_WORDS // 4, 4), dtype=np.int64)
    for table in TABLES:
        formats = coefficient_formats(table, arith)
        c = table.coefficients
        words = np.stack([f.quantise(c[:, k]) for k, f in enumerate(formats)], axis=1)
        memory[table.block, table.first : table.last + 1] = words
    for table, edge, unused in (
        (RSQRT, RSQRT.first, slice(0, RSQRT.first)),
        (ASIN, ASIN.last + 1, slice(ASIN.last + 1, RECIPROCAL.first)),
    ):
        constant = coefficient_formats(table, arith)[0].quantise(float(table.at(edge)))
        memory[table.block, unused, 0] = constant
    return tuple(int(w) for w in memory.ravel())
