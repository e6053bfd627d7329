"""Names and texts such that C takes them, as other forms of text do."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

__all__ = ["comment", "identifier", "unique"]


def identifier(name: str) -> str:
    """Letters, digits and underscores of ``name``; begins with a letter.

    Words of C stay as they are: `firmware.names.identifier` changes them too.
    """
    text = re.sub(r"[^A-Za-z0-9_]", "_", name).lstrip("_") or "unnamed"
    return f"n{text}" if text[0].isdigit() else text


def unique(
    names: Iterable[str],
    *,
    taken: Iterable[str] = (),
    fold: bool = True,
    make: Callable[[str], str] = identifier,
) -> list[str]:
    """What ``make`` makes of each name; the second of a kind gets ``_2``, the third ``_3``.

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
        base = make(name)
        candidate, count = base, 1
        while key(candidate) in used:
            count += 1
            candidate = f"{base}_{count}"
        used.add(key(candidate))
        out.append(candidate)
    return out


def comment(text: str) -> str:
    """``text`` such that it can stand in any C comment: one line, no comment marks, trigraphs."""
    plain = "".join(c if c.isprintable() and c not in "\\?" else "_" for c in text)
    return plain.replace("*/", "*_").replace("/*", "_*")
