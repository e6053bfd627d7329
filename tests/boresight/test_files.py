"""Output files of verbs: what is refused, what is replaced, what an interruption leaves."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from boresight.model.tools.files import MANIFEST

RUN = "run mine.py mine.csv --levels float -q -o"
COMPILE = "compile mine.py -q -o"


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    ("line", "found"),
    [
        (f"{RUN} notes.csv", "notes.csv: .* found a file not written by boresight; .*--force"),
        (f"{RUN} mine.csv", "found the same file as the input mine.csv"),
        (f"{RUN} link.csv", "found the same file as the input mine.csv"),
        (f"{RUN} mine.csv --force", "found the same file as the input mine.csv"),
        (f"{RUN} notes.csv/out.csv", "notes.csv: wanted a folder, found a file;"),
        (f"{COMPILE} filled", "found a file not written by boresight; .*--force"),
        (f"{COMPILE} notes.csv", "notes.csv: wanted a folder, found a file;"),
        (f"{COMPILE} deep", "deep/core.v: wanted a file, found a folder; move it away"),
        (f"{COMPILE} deep --force", "deep/core.v: wanted a file, found a folder; move it away"),
    ],
)
def test_refused(line: str, found: str, here: Path, refused: Callable[[str], str]) -> None:
    (here / "notes.csv").write_text("user")
    (here / "link.csv").symlink_to("mine.csv")
    (here / "filled").mkdir()
    (here / "filled" / "core.v").write_text("user")
    (here / "deep" / "core.v").mkdir(parents=True)
    before = files(here)
    assert re.search(found, refused(line))
    assert files(here) == before


def test_replaced_until_it_is_edited(
    here: Path, said: Callable[..., str], refused: Callable[[str], str]
) -> None:
    said(f"{RUN} new/out.csv")
    first = (here / "new" / "out.csv").read_text()
    said(f"{RUN} new/out.csv")
    (here / "new" / "out.csv").write_text("edited")
    assert "an edited file" in refused(f"{RUN} new/out.csv")
    said(f"{RUN} new/out.csv --force")
    assert (here / "new" / "out.csv").read_text() == first


def test_a_lost_list_is_no_dead_end_and_old_files_go(
    here: Path, said: Callable[..., str], refused: Callable[[str], str]
) -> None:
    said(f"{COMPILE} out")
    written = files(here / "out")
    (here / "out" / MANIFEST).unlink()
    refused(f"{COMPILE} out")
    said(f"{COMPILE} out --force")
    assert files(here / "out") == written
    for name in ("own.c", "mine.c"):
        (here / "out" / "firmware" / name).write_text("user")
    text = said("compile complementary -q -o out")
    assert text.count("kept, as") == 1 and "warning: out/firmware/mine.c: of an earlier " in text
    left = files(here / "out")
    assert [name for name in left if "mine" in name] == ["firmware/mine.c"]
    assert left["firmware/mine.c"] == left["firmware/own.c"] == b"user"
    assert "firmware/complementary.c" in left


SLEEPS = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # not as in the background
from boresight.cli import main
import boresight.verbs.compile as module
def work(*args, **options):
    print("at work", flush=True)
    time.sleep(20)
module.core_texts = work
sys.exit(main(sys.argv[1:]))
"""


def test_an_interruption_leaves_nothing(here: Path) -> None:
    before = files(here)
    with subprocess.Popen(
        [sys.executable, "-c", SLEEPS, *COMPILE.split(), "new/deep"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == b"at work\n", process.stderr.read()
        os.kill(process.pid, signal.SIGINT)
        assert b"Traceback" not in process.stderr.read()
    assert process.returncode == 130
    assert files(here) == before and not (here / "new").exists()
