"""Mutants that no test can notice, with the reason: `equivalent.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

_FILE = Path(__file__).with_name("equivalent.toml")


def equivalents(path: Path = _FILE) -> dict[str, str]:
    """Reason by key (`edits.Mutant.key`)."""
    groups = tomllib.loads(path.read_text("utf-8"))
    pairs = [(key, reason) for reason, keys in groups.items() for key in keys]
    reasons = dict(pairs)
    if len(reasons) != len(pairs) or not all(reasons.values()):
        raise ValueError(f"{path.name}: every mutant once, each with a reason")
    return reasons


def stale(reasons: Mapping[str, str], keys: Iterable[str]) -> list[str]:
    """Entries of the list that are no mutant of today's code."""
    return sorted(set(reasons) - set(keys))
