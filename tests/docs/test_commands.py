"""The page of commands says what the verbs take."""

from __future__ import annotations

import runpy

from boresight.cli import verb_of
from boresight.verbs import VERBS
from tests.support.pages import ROOT

WRITER = runpy.run_path(str(ROOT / "docs" / "site" / "commands.py"))


def test_the_page_is_current() -> None:
    text = WRITER["PAGE"].read_text(encoding="utf-8")
    assert WRITER["page"](text) == text, "make docs writes it anew"


def test_every_argument_is_in_a_section() -> None:
    for name in VERBS:
        lines = WRITER["section"](name).splitlines()
        for argument in verb_of(name).arguments.values():
            rows = [line for line in lines if line.endswith(f" | {argument.text} |")]
            assert any(row.replace("\\", "").startswith(f"| `{argument.shown}` ") for row in rows)
