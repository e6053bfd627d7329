"""Names, layout and static functions of the emitted C, integer or floating.

The functions are operations of `model.words.fixed`; nothing is undefined. Accumulators are
unsigned, so that no sum can overflow. A negative number is shifted right only if the compiler's
shift is arithmetic, which it decides at compile time.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping, Sequence

from boresight.model.tools import c_names
from boresight.model.words.fixed import Arithmetic

#: Words that are illegal as members: keywords of C and C++, macros of headers and ours.
_RESERVED_TEXT = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false NULL offsetof
    asm typeof alignas alignof atomic noreturn thread_local static_assert nullptr constexpr
    and and_eq bitand bitor catch char8_t char16_t char32_t class compl concept const_cast delete
    dynamic_cast explicit export friend mutable namespace new not not_eq operator or or_eq private
    protected public reinterpret_cast requires static_cast template this throw try typeid typename
    using virtual wchar_t xor xor_eq co_await co_return co_yield consteval constinit unix linux
    typeof_unqual complex errno stderr stdin stdout I INFINITY M_PI NAN
    WORD GUARD ROUND WORD_MAX WORD_MIN NORM_MAX QUARTER FRACTION_BITS FRACTION_MASK INDEX_MASK
"""
RESERVED = frozenset(_RESERVED_TEXT.split())
#: Standard headers: a file of such a name beside the others would be found in place of them.
_HEADERS_TEXT = """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdarg
    stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string tgmath threads time
    uchar wchar wctype
"""
HEADERS = frozenset(_HEADERS_TEXT.split())

#: Macros and types of the standard headers.
RESERVED_PATTERN = re.compile(
    r"u?int\w*_t|(size|ptrdiff|wchar)_t|U?INT\w*_(MAX|MIN|C)|(PTRDIFF|SIZE|SIG_ATOMIC|WCHAR|WINT)_(MAX|MIN|WIDTH)"
)
#: Stems whose ``<stem>_t`` belongs to the standard headers.
_TYPE_STEM = re.compile(r"u?int((_least|_fast)?\d+|ptr|max)|s?size|ptrdiff|wchar|max_align")


def identifier(name: str) -> str:
    """Return a C identifier similar to ``name``.

    Letters, digits and underscores remain, other characters become underscores. Reserved words get
    a suffix, names that begin with a digit a prefix.
    """
    text = c_names.identifier(name)
    return f"{text}_" if text in RESERVED or RESERVED_PATTERN.fullmatch(text) else text


def stem(name: str) -> str:
    """The identifier of a program, which is also the name of its files."""
    text = identifier(name)
    text = f"{text}_" if text.lower() in HEADERS else text
    return f"{text}_program" if _TYPE_STEM.fullmatch(text) else text


#: `model.tools.c_names.unique` of such identifiers.
unique = functools.partial(c_names.unique, fold=False, make=identifier)


def literal(word: int) -> str:
    """A word as an int32_t constant expression."""
    return "INT32_MIN" if word == -(2**31) else str(word)


_RULE = "//" + 78 * "-"
#: Longest line.
_WIDTH = 100

#: Last lines of a file.
END = f"{_RULE}\n// End of file"


def banner(title: str) -> str:
    return f"{_RULE}\n// {title}"


def block(opening: str, lines: Iterable[str]) -> str:
    """Indented lines in braces; too long an opening gets a line for each argument."""
    if max(map(len, opening.splitlines())) + 2 > _WIDTH:
        opening = opening.replace("(", "(\n    ", 1).replace(", ", ",\n    ")
    return "\n".join([f"{opening} {{", *(f"    {line}" if line else "" for line in lines), "}"])


def join(*parts: str) -> str:
    """A file: the parts that are not empty, separated by blank lines."""
    return "\n\n".join(part for part in parts if part) + "\n"


def head(file: str, brief: str, *origin: str) -> str:
    """First comment of a file; ``origin`` names the source."""
    lines = [f"@file {file}", f"@brief {brief}", "", *origin]
    return "\n".join(["/**", *(f" * {line}".rstrip() for line in lines), " */"])


def header(
    name: str,
    first: str,
    *,
    definitions: str,
    members: Mapping[str, Sequence[str]],
    number: str,
    words: str,
    start: str,
) -> str:
    """Text of ``<name>.h``.

    ``members`` are those of the structures ``params``, ``state``, ``in`` and ``out``; ``number`` is
    the C type of a number, ``words`` a text after "inputs of one update", ``start`` one for the
    initial values of the states.
    """

    def struct(kind: str, note: str, lines: Sequence[str]) -> str:
        lines = lines or [f"{number} none; // nothing: C99 has no empty structure"]
        return f"// {note}\n{block('typedef struct', lines)} {name}{kind}_t;"

    guard = f"{name.upper()}_H"
    return join(
        first,
        f"#ifndef {guard}\n#define {guard}",
        banner("Includes"),
        "#include <stdbool.h>\n#include <stdint.h>",
        banner("Definitions"),
        definitions,
        struct("_params", "Parameters: may be changed between updates.", members["params"]),
        struct("_state", "States: all members private.", members["state"]),
        struct("", "Estimator.", [f"{name}_params_t params;", f"{name}_state_t state;"]),
        struct("_in", f"Inputs of one update{words}.", members["in"]),
        struct("_out", "Outputs of one update.", members["out"]),
        banner("Function declarations"),
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"// Sets the parameters to their defaults and the states to their {start}.\n"
        f"void {name}_init({name}_t *self);",
        f"// Sets the states to their {start}.\nvoid {name}_reset({name}_t *self);",
        "// Runs one update.\n"
        f"void {name}_update({name}_t *self, const {name}_in_t *in, {name}_out_t *out);",
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    )


def source(
    name: str,
    first: str,
    *,
    before: Sequence[str],
    params: Sequence[str],
    states: Sequence[str],
    update: Sequence[str],
) -> str:
    """Text of ``<name>.c``; ``before`` precedes its functions, the rest are statements."""
    text = "\n".join(update)
    unused = [f"(void) {word};" for word in ("self", "in", "out") if f"{word}->" not in text]
    return join(
        first,
        banner("Includes"),
        f'#include "{name}.h"',
        *before,
        block(f"void {name}_init({name}_t *const self)", [*params, f"{name}_reset(self);"]),
        block(f"void {name}_reset({name}_t *const self)", states or ["(void) self;"]),
        block(
            f"void {name}_update({name}_t *const self, const {name}_in_t *const in, "
            f"{name}_out_t *const out)",
            [*unused, *update],
        ),
        END,
    )


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
    return set(re.findall(r"\b(\w+)\(", text))
