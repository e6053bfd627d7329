"""`docs/architecture.md`: the files that it names are there, in an order in which they are used."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "architecture.md").read_text()


def test_every_file_is_there():
    named = re.findall(r"`([a-z_0-9/]+\.(?:py|md))`", TEXT)
    assert len(named) > 40
    missing = [name for name in named if not (ROOT / name).is_file()]
    assert not missing


def test_the_walk_from_log_to_verdict_is_short_and_names_no_file_twice():
    walk = TEXT[TEXT.index("## A log") : TEXT.index("## A sample")]
    rows = re.findall(r"^\| `.*?\|", walk, re.M)
    named = [name for row in rows for name in re.findall(r"`([a-z_0-9/]+\.py)`", row)]
    assert len(named) == len(set(named)) <= 12
