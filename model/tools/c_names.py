"""Identifiers and comments that are legal in C, and so in the other generated languages."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable


def identifier(name: str) -> str:
    """Return the letters, digits and underscores of ``name``, beginning with a letter.

    Reserved words of C stay unchanged; see `firmware.layout.identifier`.
    """
    text = re.sub(r"[^A-Za-z0-9_]", "_", name).lstrip("_") or "unnamed"
    return f"n{text}" if text[0].isdigit() else text


def unique(
    names: Iterable[str],
    *,
    reserved: Iterable[str] = (),
    fold: bool = True,
    make: Callable[[str], str] = identifier,
) -> list[str]:
    """Apply ``make`` to each name; repeated results get the suffixes ``_2``, ``_3``, ...

    ``reserved`` are in use already; ``fold``: names that differ only in case count as equal.
    """
    key: Callable[[str], str] = str.upper if fold else str
    used = {key(x) for x in reserved}
    out: list[str] = []
    for name in names:
        base = make(name)
        candidate, count = base, 1
        while key(candidate) in used:
            count += 1
            candidate = f"{base}_{count}"
        used.add(key(candidate))
        out.append(candidate)
    return out


def comment(text: str) -> str:
    """Return ``text`` for a C comment: one line, without comment marks and trigraphs."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else "_" for c in text)
    return re.sub(r"[\\?]", "_", text).replace("*/", "*_").replace("/*", "_*")
