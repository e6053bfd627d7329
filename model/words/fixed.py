"""Integer semantics of every fixed-point operation.

The interpreter (`model.words.interpreter`), the generated C (`firmware.emit`) and the core
(`gateware.engine.lane`) implement exactly this definition; tests compare this file with the
independent package ``apytypes``.

A *word* is a W-bit two's complement integer; a `Format` adds the binary point. The only
arithmetic operation is the multiply-accumulate group (see `model.words.program.Op`)::

    acc  = 2^(G-1) + sum_k  sign_k * floor(a_k * b_k / 2^s_k)      G guard bits, exact
    q    = floor(acc / 2^G)                                        RND: half up
    dest = SAT: clamp(q) to W bits      WRAP: q modulo 2^W

``s_k`` is the static shift of the term, less the *normalisation count* where the term requests
it. Products have at most 2W-1 bits, the accumulator at most `Arithmetic.acc_width` bits (the
compiler proves this for every operation), so everything fits int64.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.arrays import IntArray as IntArray
from boresight.model.errors import require
from boresight.model.words.rounded import binary_exponent

#: Widths of words, bits.
WORDS = range(18, 33)


def check_word(word: Any) -> None:
    """Raise InputError unless words may have ``word`` bits."""
    good = isinstance(word, int | np.integer) and word in WORDS
    fix = "choose a width inside the range"
    require(good, "word", f"{WORDS[0]} to {WORDS[-1]} bits", word, fix)


@dataclass(frozen=True)
class Arithmetic:
    """Widths of the machine's arithmetic."""

    #: Bits of a word, W: 18 to 32.
    word: int = 32
    #: Fraction bits of the accumulator below the result's last bit, G. Default (0): 8 for words
    #: from 28 bits, 6 from 22, else 4; fewer leave more room to normalise.
    guard: int = 0
    #: Integer bits of the accumulator above the result's sign bit.
    headroom: int = 20

    #: Bits of the segment index of a function table (128 segments over one power of two).
    INDEX_BITS = 7
    #: Bits of a term's shift field: shifts are 0..31.
    SHIFT_BITS = 5

    def __post_init__(self) -> None:
        if self.word not in WORDS:
            raise ValueError(f"word must be {WORDS[0]} to {WORDS[-1]} bits, not {self.word!r}")
        if self.guard == 0:
            object.__setattr__(self, "guard", 4 + 2 * (self.word >= 22) + 2 * (self.word >= 28))

    @property
    def acc_width(self) -> int:
        """Bits of the accumulator: W + G + headroom."""
        return self.word + self.guard + self.headroom

    @property
    def shift_max(self) -> int:
        return (1 << self.SHIFT_BITS) - 1

    @property
    def norm_max(self) -> int:
        """Largest normalisation count: x * 2^(W-2) shifted by W-2-G-n must not need n < 0."""
        return self.word - 2 - self.guard

    @property
    def fraction_bits(self) -> int:
        """Bits below the segment index: the position inside a segment."""
        return self.word - 1 - self.INDEX_BITS

    @property
    def min_int(self) -> int:
        return -(1 << (self.word - 1))

    @property
    def max_int(self) -> int:
        return (1 << (self.word - 1)) - 1


@dataclass(frozen=True)
class Format:
    """Binary point of a word: value = integer * 2^-frac.

    ``frac`` may be negative or exceed the word. ``str()`` gives the ``ap_fixed`` notation
    ``fixed<W,I>`` where I counts the integer bits with the sign.
    """

    word: int
    frac: int

    def __str__(self) -> str:
        return f"fixed<{self.word},{self.word - self.frac}>"

    @property
    def lsb(self) -> float:
        return math.ldexp(1.0, -self.frac)

    @property
    def min(self) -> float:
        return -math.ldexp(1.0, self.word - 1 - self.frac)

    @property
    def max(self) -> float:
        return math.ldexp((1 << (self.word - 1)) - 1, -self.frac)

    def quantise(self, value: Any) -> IntArray:
        """Nearest word to each value (ties up, as RND), saturated to the format."""
        scaled = np.asarray(_scaled(value, self.frac) + 0.5)
        limit = 2 ** (self.word - 1)
        np.floor(scaled, out=scaled)
        words = scaled.clip(-limit, limit - 1, out=scaled).astype(np.int64)
        return words[()]  # of one value a scalar

    def real(self, integer: Any) -> FloatArray:
        return _scaled(integer, -self.frac)

    @classmethod
    def declared(cls, word: int, low: float, high: float, unit: str) -> Format:
        """Format of a declaration with this range; binary angles fill the word and wrap."""
        if unit == "ht" and low >= -1.0 and high <= 1.0:
            return cls(word, word - 1)
        return cls.for_range(word, low, high)

    @classmethod
    def for_range(cls, word: int, low: float, high: float) -> Format:
        """Finest format of ``word`` bits that holds [low, high]."""
        if not (np.isfinite(low) and np.isfinite(high) and low <= high):
            raise ValueError(f"range must be finite and ordered, not [{low!r}, {high!r}]")
        magnitude = max(abs(low), abs(high))
        if magnitude == 0.0:
            return cls(word, word - 1)
        fmt = cls(word, word - 1 - binary_exponent(magnitude))
        while high > fmt.max or low < fmt.min:
            fmt = cls(word, fmt.frac - 1)
        return fmt


def _scaled(values: Any, power: Any) -> FloatArray:
    # A product with a normal number has the bits of `ldexp`, and takes a fifth of the time.
    real = np.asarray(values, dtype=np.float64)
    if real.ndim and np.abs(power).max() < 1000:
        return cast(FloatArray, real * np.ldexp(1.0, power))
    return cast(FloatArray, np.ldexp(real, power))


def wrap(q: Any, word: int) -> Any:
    """WRAP: ``q`` modulo 2^word as two's complement."""
    half = 1 << (word - 1)
    return ((q + half) & ((1 << word) - 1)) - half


def saturate(q: Any, word: int) -> Any:
    """SAT: ``q`` clamped to the word."""
    return np.minimum(np.maximum(q, -(1 << (word - 1))), (1 << (word - 1)) - 1)


def leading_sign_count(x: Any, arith: Arithmetic) -> Any:
    """Normalisation count n: number of bits by which ``x`` can be shifted left without overflow.

    Counts the copies of the sign bit below the sign bit, at most `Arithmetic.norm_max`.
    """
    # Exact as float64; `frexp` returns the length of the magnitude in bits.
    _, length = np.frexp(np.asarray(x ^ (x >> 63), dtype=np.float64))
    return np.minimum(arith.word - 1 - length, arith.norm_max, dtype=np.int64)
