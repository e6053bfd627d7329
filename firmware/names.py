"""Names of a program as C identifiers, words as C literals, texts as C comments."""

from __future__ import annotations

import re
from collections.abc import Iterable

__all__ = ["comment", "identifier", "literal", "unique"]

#: Words that may not name a member: keywords of C and C++, macros of the headers in use.
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

#: Macros and types of the standard headers.
RESERVED_PATTERN = re.compile(
    r"u?int\w*_t|(size|ptrdiff|wchar)_t|U?INT\w*_(MAX|MIN|C)|(PTRDIFF|SIZE|SIG_ATOMIC|WCHAR|WINT)_(MAX|MIN|WIDTH)"
)


def identifier(name: str) -> str:
    """A C identifier as near to ``name`` as possible.

    Letters, digits and underscores remain, everything else becomes an underscore; what would be
    reserved or begin with a digit gets the suffix or prefix that makes it legal.
    """
    text = re.sub(r"[^A-Za-z0-9_]", "_", name).lstrip("_")
    if not text:
        return "unnamed"
    if text[0].isdigit():
        return f"n{text}"
    if text in RESERVED or RESERVED_PATTERN.fullmatch(text):
        return f"{text}_"
    return text


def unique(names: Iterable[str], *, taken: Iterable[str] = (), fold: bool = False) -> list[str]:
    """`identifier` of each name; the second of a kind gets ``_2``, the third ``_3`` and so on.

    Parameters
    ----------
    names : iterable of str
        Names in order.
    taken : iterable of str
        Identifiers that are in use already.
    fold : bool
        Names that differ in case only count as the same.
    """

    def key(x: str) -> str:
        return x.upper() if fold else x

    used = {key(x) for x in taken}
    out: list[str] = []
    for name in names:
        base = identifier(name)
        candidate, count = base, 1
        while key(candidate) in used:
            count += 1
            candidate = f"{base}_{count}"
        used.add(key(candidate))
        out.append(candidate)
    return out


def literal(word: int) -> str:
    """A word as an int32_t constant expression."""
    return "INT32_MIN" if word == -(2**31) else str(word)


def comment(text: str) -> str:
    """``text`` such that it can stand in any C comment: one line, no comment marks, trigraphs."""
    plain = "".join(c if c.isprintable() and c not in "\\?" else "_" for c in text)
    return plain.replace("*/", "*_").replace("/*", "_*")
