"""Mutants that no test can notice, with the reason: `equivalent.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

__all__ = ["equivalents", "stale"]

_FILE = Path(__file__).with_name("equivalent.toml")


def equivalents(path: Path = _FILE) -> dict[str, str]:
    """Reason by key (`edits.Mutant.key`)."""
    rows = tomllib.loads(path.read_text("utf-8")).get("mutant", [])
    reasons = {row["key"]: row["reason"] for row in rows}
    if len(reasons) != len(rows) or not all(reasons.values()):
        raise ValueError(f"{path.name}: every mutant once, each with a reason")
    return reasons


def stale(reasons: Mapping[str, str], keys: Iterable[str]) -> list[str]:
    """Entries of the list that are no mutant of today's code."""
    return sorted(set(reasons) - set(keys))
