"""Every code block of the pages for users runs, and prints what the page says."""

from __future__ import annotations

from pathlib import Path

import pytest

from boresight.verbs import VERBS
from tests.support import pages

#: Pages with a test of their own beside this one.
OWN = {f"docs/{path.stem.removeprefix('test_')}.md" for path in Path(__file__).parent.glob("*.py")}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "examples").symlink_to(pages.ROOT / "examples")
    with pages.user_folder(tmp_path, monkeypatch):
        yield tmp_path


@pytest.mark.parametrize("page", [page for page in pages.PAGES if page not in OWN])
def test_blocks(page, folder):
    pages.run_page(page, folder)


def test_all_pages_of_the_site_are_here():
    written = {
        path.relative_to(pages.ROOT).as_posix()
        for path in (pages.ROOT / "docs").rglob("*.md")
        if path.name != "commands.md"
    }
    assert written | {"README.md"} == set(pages.PAGES)
    assert len(written) > 15


def test_every_verb_is_on_a_page():
    text = "".join((pages.ROOT / page).read_text(encoding="utf-8") for page in pages.PAGES)
    assert not [verb for verb in VERBS if f"boresight {verb}" not in text]
