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
        if path.parent.name != "decisions"
    }
    assert written | {"README.md"} == set(pages.PAGES)
    assert len(written) > 15


def test_every_verb_is_on_a_page():
    text = "".join((pages.ROOT / page).read_text(encoding="utf-8") for page in pages.PAGES)
    assert not [verb for verb in VERBS if f"boresight {verb}" not in text]
<<<<<<< HEAD


# -- the runner itself, on pages made up -----------------------------------------------------------


@pytest.fixture
def page(folder, monkeypatch):
    """A function that runs a page of these blocks."""

    def run(*parts: str) -> int:
        (folder / "page.md").write_text("\n\n".join(parts))
        monkeypatch.setattr(pages, "ROOT", folder)
        return pages.run_page("page.md", folder)

    return run


def block(language: str, text: str) -> str:
    return f"```{language}\n{text}\n```"


GOOD = (
    "Save it as `mine.py`:",
    block("python", "NUMBER = 7"),
    block("python", "import mine\nprint('seven is', mine.NUMBER, 2.51)"),
    block("text", "seven is 7 2.5"),
    block("sh", "mkdir sub  # a folder"),
    "<!-- parsed, not run: too long -->",
    block("sh", "boresight bench mekf"),
    block("", "a drawing"),
    block("{toctree}", "page"),
)


def test_a_good_page_runs(page, folder):
    assert page(*GOOD) == 7
    assert (folder / "mine.py").read_text() == "NUMBER = 7\n" and (folder / "sub").is_dir()


@pytest.mark.parametrize(
    ("good", "bad", "message"),
    [
        ("print('seven is'", "print('six is'", "shown"),
        ("2.51)", "3.51)", "shown"),
        ("mine.NUMBER, 2", "mine.NUMBER + 1, 2", "shown"),
        ("mkdir", "rmdir", "is not run by any test"),
        ("mkdir sub", "boresight list --colour", "colour"),
        ("mkdir sub", "boresight check mekf nosuch.csv", "nosuch.csv"),
        ("bench mekf", "bench mekf --updates many", "updates"),
        ("bench mekf", "bunch mekf", "bunch"),
        ("boresight bench", "rm -rf", "what is"),
        ("```\na drawing", "```rust\na drawing", "no test runs rust"),
        ("```python\nimport", "```text\nimport", "the output of nothing"),
    ],
)
def test_a_fault_on_a_page_is_told(good, bad, message, page):
    assert sum(good in part for part in GOOD) == 1
    with pytest.raises((AssertionError, SystemExit)) as failed:
        page(*(part.replace(good, bad) for part in GOOD))
    assert isinstance(failed.value, SystemExit) or message in str(failed.value)


@pytest.mark.parametrize(
    ("shown", "said", "same"),
    [
        ("a\n...\nd", "a\nb\nc\nd", True),
        ("a\n...", "a", True),
        ("a\n...\nd", "a\nb", False),
        ("...\nb", "a", False),
        ("max 1.2e-07 m in step 3", "max 1.3e-07 m in step 3", True),
        ("max 1.2e-07 m in step 3", "max 1.3e-06 m in step 3", False),
        ("max 1.2e-07 m in step 3", "max 1.2e-07 m in step 4", False),
        ("max 1.2e-07 m", "max 1.2e-07 s", False),
        ("  c  gcc  [0/4]  0.1 s", "  c  gcc  [0/4]  7.4 s", True),
        ("  c  gcc  [0/4]  0.1 s", "  c  gcc  [1/4]  0.1 s", False),
        ("300 records, 5,267 a second", "300 records, 12 a second", True),
        ("300 records, 5,267 a second", "301 records, 5,267 a second", False),
        ("a", "a\nb", False),
    ],
)
def test_what_counts_as_the_same(shown, said, same):
    assert pages.same_text(shown, said) is same
=======
>>>>>>> 595fe360 (docs: commands and results as they are; tests.docs: the pages, not their runner)
