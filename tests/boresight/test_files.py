"""Verbs that write: what they refuse before the work, what they write, and what `--force` does."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.model.tools.files import MANIFEST

pytestmark = pytest.mark.pythons

LOG = "t,gx,gy,gz,ax,ay,az,mx,my,mz,qw,qx,qy,qz\n" + "".join(
    f"{k / 100},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40,1,0,0,0\n" for k in range(20)
)
RUN = ["run", "complementary", "log.csv", "--on", "float", "-q", "-o"]
COMPILE = ["compile", "complementary", "-q", "-o"]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of the user, and the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "notes.txt").write_text("user")
    (tmp_path / "link.csv").symlink_to("log.csv")
    (tmp_path / "filled" / "firmware").mkdir(parents=True)
    (tmp_path / "filled" / "core.v").write_text("user")
    (tmp_path / "blocked").mkdir()
    (tmp_path / "blocked" / "firmware").write_text("user")
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    ("words", "output", "found"),
    [
        (RUN, "notes.txt", "found a file not written by boresight; .*--force"),
        (RUN, "log.csv", "found the same file as the input log.csv"),
        (RUN, "link.csv", "found the same file as the input log.csv"),
        (RUN, "filled", "found a folder"),
        (RUN, "notes.txt/out.csv", "found a file 'notes.txt' where a folder must be"),
        (RUN, "", "found ''"),
        (COMPILE, "filled", "found a file not written by boresight; .*--force"),
        (COMPILE, "blocked", "found a file 'firmware' where a folder must be"),
        (COMPILE, "notes.txt", "found a file 'notes.txt' where a folder must be"),
        (["check", "complementary", "log.csv", "--reproducer"], "notes.txt", "not written by"),
    ],
)
def test_refused_before_the_work(
    words: list[str],
    output: str,
    found: str,
    home: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for work in ("run.feeds", "compile.core_texts", "check.Check.run"):
        monkeypatch.setattr(f"boresight.verbs.{work}", lambda *a, **k: pytest.fail("worked"))
    before = files(home)
    assert main([*words, output]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1
    assert re.search(found, printed.err)
    assert files(home) == before


def test_written_again_until_it_is_edited(home: Path) -> None:
    output = home / "new" / "deep" / "out.csv"
    assert main([*RUN, str(output)]) == 0
    first = output.read_text()
    assert first.count("\n") == 21
    assert main([*RUN, str(output)]) == 0
    output.write_text("edited")
    assert main([*RUN, str(output)]) == 2
    assert output.read_text() == "edited"
    assert main([*RUN, str(output), "--force"]) == 0
    assert output.read_text() == first


def test_a_lost_list_of_files_is_no_dead_end(home: Path) -> None:
    assert main([*COMPILE, "out"]) == 0
    written = files(home / "out")
    (home / "out" / MANIFEST).unlink()
    assert main([*COMPILE, "out"]) == 2
    assert main(["compile", "--force", *COMPILE[1:], "out"]) == 0
    assert files(home / "out") == written


def test_compile_removes_its_files_of_another_estimator(home: Path) -> None:
    assert main([*COMPILE[:1], "complementary_as_printed", *COMPILE[1:], "out"]) == 0
    (home / "out" / "firmware" / "mine.c").write_text("user")
    assert main([*COMPILE, "out"]) == 0
    left = files(home / "out")
    assert not [name for name in left if "as_printed" in name]
    assert left["firmware/mine.c"] == b"user" and "firmware/complementary.c" in left


def test_standard_output_is_a_file_too(capfd: pytest.CaptureFixture[str]) -> None:
    assert main([*RUN, "/dev/stdout"]) == 0
    assert capfd.readouterr().out.startswith("t[s],")


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


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ended_in_the_middle_leaves_nothing(number: int, code: int, home: Path) -> None:
    before = files(home)
    with subprocess.Popen(
        [sys.executable, "-c", SLEEPS, *COMPILE, "new/deep"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == b"at work\n", process.stderr.read()
        os.kill(process.pid, number)
        assert b"Traceback" not in process.stderr.read()
    assert process.returncode == code
    assert files(home) == before and not (home / "new").exists()
