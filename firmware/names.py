"""Names of a program as C identifiers, words as C literals."""

from __future__ import annotations

import functools
import re

from boresight.model.tools import c_names

#: Words that are illegal as members: keywords of C and C++, macros of the headers in use.
_RESERVED_TEXT = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false NULL offsetof
    asm typeof alignas alignof atomic noreturn thread_local static_assert nullptr constexpr
    and and_eq bitand bitor catch char8_t char16_t char32_t class compl concept const_cast delete
    dynamic_cast explicit export friend mutable namespace new not not_eq operator or or_eq private
    protected public reinterpret_cast requires static_cast template this throw try typeid typename
    using virtual wchar_t xor xor_eq unix linux
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
