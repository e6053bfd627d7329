"""Every code block of the pages for users runs, and prints what the page says."""

from __future__ import annotations

import sys

import pytest

from boresight.verbs.texts import VERBS
from tests.support import pages


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A user's folder, in which his modules are found, with the examples."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])  # what a page adds goes again
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    # Verilator alone: what a second simulator says is tested elsewhere.
    monkeypatch.setattr("boresight.sim.levels.rtl.available", lambda name: False)
    (tmp_path / "examples").symlink_to(pages.ROOT / "examples")
    return tmp_path


@pytest.mark.full_search
@pytest.mark.parametrize("page", pages.PAGES)
def test_blocks(page, folder):
    pages.run_page(page, folder)


def test_all_pages_of_the_site_are_here():
    written = {
        path.relative_to(pages.ROOT).as_posix()
        for path in (pages.ROOT / "docs").rglob("*.md")
        if path.parent.name != "decisions"
    }
    assert written | {"README.md"} == set(pages.PAGES)
    assert len(written) > 15


def test_every_verb_is_on_a_page():
    text = "".join((pages.ROOT / page).read_text(encoding="utf-8") for page in pages.PAGES)
    assert not [verb for verb in VERBS if f"boresight {verb}" not in text]
