"""Static functions of the emitted C: operations of `model.words.fixed`; nothing undefined.

Accumulators are unsigned, so that no sum can overflow. A negative number is shifted right only if
the compiler's shift is arithmetic, which it decides at compile time.
"""

from __future__ import annotations

import re

from boresight.model.words.fixed import Arithmetic


def definitions(arith: Arithmetic) -> str:
    """Macros with the widths that the helpers use."""
    return f"""\
#define WORD ({arith.word}u) // bits of a word
#define GUARD ({arith.guard}u) // bits of the accumulator below the result
#define ROUND (UINT64_C({(1 << arith.guard) >> 1})) // half of the result's least significant bit
#define WORD_MAX (INT64_C({arith.max_int}))
#define WORD_MIN (-WORD_MAX - 1)
#define NORM_MAX ({max(arith.norm_max, 0)}u) // largest normalisation count
#define QUARTER (UINT32_C({1 << (arith.word - 2)})) // quarter of the word's range
#define FRACTION_BITS ({arith.fraction_bits}u) // bits below the segment index
#define FRACTION_MASK (UINT32_C({(1 << arith.fraction_bits) - 1}))
#define INDEX_MASK (UINT32_C({(1 << arith.INDEX_BITS) - 1}))"""


_HELPERS = {
    "shift_right": """\
// floor(x / 2^s)
static inline int64_t shift_right(const int64_t x, const uint32_t s) {
    if ((((int64_t) -1) >> 1) == -1 || x >= 0) { // the left side is a constant: >> is arithmetic
        return x >> s;
    }
    return ~(~x >> s);
}""",
    "mul_shift": """\
// floor(a * b / 2^s), modulo 2^64
static inline uint64_t mul_shift(const int32_t a, const int32_t b, const uint32_t s) {
    return (uint64_t) shift_right((int64_t) a * b, s);
}""",
    "shift_less": """\
// s - n, not below 0
static inline uint32_t shift_less(const uint32_t s, const uint32_t n) {
    return s > n ? s - n : 0u;
}""",
    "negate_where": """\
// -t where the mask is set
static inline uint64_t negate_where(const uint64_t t, const uint64_t mask) {
    return (t ^ mask) - mask;
}""",
    "sign_mask": """\
// All ones when x is negative
static inline uint64_t sign_mask(const int32_t x) {
    return UINT64_C(0) - (uint64_t) (x < 0);
}""",
    "sign_mask_quarter": """\
// All ones when x plus a quarter of the range, modulo the range, is negative
static inline uint64_t sign_mask_quarter(const int32_t x) {
    return UINT64_C(0) - (uint64_t) ((((uint32_t) x + QUARTER) >> (WORD - 1u)) & 1u);
}""",
    "leading_zeros": """\
// Leading zeros of x, which is not 0
static inline uint32_t leading_zeros(const uint32_t x) {
#if defined(__GNUC__) && __SIZEOF_INT__ == 4
    return (uint32_t) __builtin_clz(x);
#else
    uint32_t count = 0u;
    while (((x << count) & UINT32_C(0x80000000)) == 0u) {
        count++;
    }
    return count;
#endif
}""",
    "sign_count": """\
// Normalisation count: copies of the sign bit below the sign bit, at most NORM_MAX
static inline uint32_t sign_count(const int32_t x) {
    const uint32_t magnitude = (x < 0 ? ~(uint32_t) x : (uint32_t) x) | 1u;
    const uint32_t count = leading_zeros(magnitude) + WORD - 33u;
    return count < NORM_MAX ? count : NORM_MAX;
}""",
    "segment_index": """\
// Bits of x below its sign bit that choose the segment of a table
static inline uint32_t segment_index(const int32_t x) {
    return ((uint32_t) x >> FRACTION_BITS) & INDEX_MASK;
}""",
    "segment_index_quarter": """\
// segment_index of x plus a quarter of the range
static inline uint32_t segment_index_quarter(const int32_t x) {
    return (((uint32_t) x + QUARTER) >> FRACTION_BITS) & INDEX_MASK;
}""",
    "fraction": """\
// Bits of x below the segment index
static inline int32_t fraction(const int32_t x) {
    return (int32_t) ((uint32_t) x & FRACTION_MASK);
}""",
    "to_signed": """\
// Two's complement reading of x
static inline int64_t to_signed(const uint64_t x) {
    return x <= (uint64_t) INT64_MAX ? (int64_t) x : -(int64_t) ~x - 1;
}""",
    "clip": """\
// Result of an accumulator, clamped
static inline int32_t clip(const uint64_t acc) {
    const int64_t q = shift_right(to_signed(acc), GUARD);
    if (q > WORD_MAX) {
        return (int32_t) WORD_MAX;
    }
    return q < WORD_MIN ? (int32_t) WORD_MIN : (int32_t) q;
}""",
    "saturate": """\
// Result of an accumulator, clamped; raises the flag
static inline int32_t saturate(const uint64_t acc, bool *const saturated) {
    const int64_t q = shift_right(to_signed(acc), GUARD);
    if (q > WORD_MAX) {
        *saturated = true;
        return (int32_t) WORD_MAX;
    }
    if (q < WORD_MIN) {
        *saturated = true;
        return (int32_t) WORD_MIN;
    }
    return (int32_t) q;
}""",
    "wrap": """\
// Result of an accumulator modulo 2^WORD
static inline int32_t wrap(const uint64_t acc) {
    const uint64_t half = UINT64_C(1) << (WORD - 1u);
    const uint64_t q = (uint64_t) shift_right(to_signed(acc), GUARD);
    return (int32_t) ((int64_t) ((q + half) & ((half << 1) - 1u)) - (int64_t) half);
}""",
    "overflow": """\
// Result of an accumulator modulo 2^WORD; raises the flag where it does not fit
static inline int32_t overflow(const uint64_t acc, bool *const beyond) {
    const int64_t q = shift_right(to_signed(acc), GUARD);
    *beyond = *beyond || q > WORD_MAX || q < WORD_MIN;
    return wrap(acc);
}""",
}


def helpers(body: str) -> str:
    """Definitions of the helpers that ``body`` calls, directly or not, each before its callers."""
    used: list[str] = []
    calls = _calls(body)
    for name in reversed(_HELPERS):
        if name in calls:
            used.append(_HELPERS[name])
            calls |= _calls(_HELPERS[name])
    return "\n\n".join(reversed(used))


def _calls(text: str) -> set[str]:
    return set(re.findall(r"(\w+)\(", text))
