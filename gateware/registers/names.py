"""Names and texts of a register map, such that C and SVD take them."""

from __future__ import annotations

import re
from collections.abc import Iterable

__all__ = ["comment", "identifier", "unique"]


def identifier(name: str) -> str:
    """Letters, digits and underscores of ``name``; begins with a letter.

    Words of C stay as they are: whoever writes C adds a prefix or a suffix.
    """
    text = re.sub(r"[^A-Za-z0-9_]", "_", name).lstrip("_") or "unnamed"
    return f"n{text}" if text[0].isdigit() else text


def unique(names: Iterable[str], *, taken: Iterable[str] = ()) -> list[str]:
    """`identifier` of each name; the second that differs in case only, or not at all, gets ``_2``.

    Parameters
    ----------
    names : iterable of str
        Names in order.
    taken : iterable of str
        Identifiers that are in use already.
    """
    used = {name.upper() for name in taken}
    out = []
    for name in names:
        candidate, count = identifier(name), 1
        while candidate.upper() in used:
            count += 1
            candidate = f"{identifier(name)}_{count}"
        used.add(candidate.upper())
        out.append(candidate)
    return out


def comment(text: str) -> str:
    """``text`` for a C comment: one line, without comment marks, line joins and trigraphs."""
    plain = "".join(c if c.isprintable() and c not in "\\?" else "_" for c in text)
    return plain.replace("*/", "*_").replace("/*", "_*")
