"""Standard output and standard error: closed, full, without a reader, or of few letters."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.model.errors import InputError
from boresight.sim.records.bundled import bundled
from boresight.terminal import ClosedPipe, say, tell

pytestmark = pytest.mark.pythons

COMMAND = [sys.executable, "-m", "boresight"]
LOG = str(bundled("synthetic_60s"))


class Broken(io.StringIO):
    """A stream that fails whenever it is written."""

    def __init__(self, error: OSError) -> None:
        super().__init__()
        self.error = error

    def write(self, text: str) -> int:
        raise self.error


@pytest.mark.parametrize(
    ("stream", "message"),
    [
        (None, "found closed"),
        (Broken(OSError(28, "No space left on device")), "found no space left on device"),
        (Broken(OSError()), "found oserror"),
    ],
)
def test_what_is_said_needs_a_place(stream, message: str, monkeypatch) -> None:
    monkeypatch.setattr(sys, "stdout", stream)
    with pytest.raises(InputError, match=f"^standard output: wanted a path .*{message}; connect"):
        say("text")


def test_a_reader_that_has_gone_ends_the_work(monkeypatch) -> None:
    monkeypatch.setattr(sys, "stdout", Broken(BrokenPipeError(32, "Broken pipe")))
    with pytest.raises(ClosedPipe):
        say("text")


@pytest.mark.parametrize("stream", [None, Broken(BrokenPipeError()), Broken(OSError(28, "full"))])
def test_what_is_told_needs_none(stream, monkeypatch) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    tell("text")


def test_a_line_at_a_time_in_letters_that_the_stream_has(monkeypatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, "ascii", newline="\n"))
    say("a\u00fcb\udcff")
    assert raw.getvalue() == b"a\\xfcb\\udcff\n"


@pytest.fixture(params=["", "1"], ids=["buffered", "unbuffered"])
def buffered(request, monkeypatch) -> None:
    """What stands in a buffer at the end is written once more, and must not fail then."""
    monkeypatch.setenv("PYTHONUNBUFFERED", request.param)


def shell(line: str, tmp_path: Path) -> tuple[int, str]:
    """Exit code of the first command of a pipe, and what it said on stderr."""
    script = f'{" ".join(COMMAND)} {line}; exit "${{PIPESTATUS[0]}}"'
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stderr


@pytest.mark.pythons
@pytest.mark.usefixtures("buffered")
@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("list | exec 0<&-", 141, ""),
        ("list --json | exec 0<&-", 141, ""),
        ("run --help | exec 0<&-", 141, ""),
        ("list > /dev/full", 2, "standard output: wanted a path that can be written, found no sp"),
        ("list >&-", 2, "standard output: wanted a path that can be written, found closed"),
        ("run mekf nosuch 2>&-", 2, ""),
    ],
)
def test_a_closed_output(line: str, code: int, words: str, tmp_path) -> None:
    got, said = shell(line, tmp_path)
    assert got == code and words in said and said.count("\n") == bool(words), said


@pytest.mark.usefixtures("buffered")
def test_progress_is_never_worth_a_stop(tmp_path) -> None:
    check = f"check complementary {LOG} --levels c --steps 20"
    for deaf in ("2> >(exec 0<&-)", "2>&-", "2>/dev/full"):
        code, said = shell(f"{check} {deaf} | tail -1 | grep -x good >&2", tmp_path)
        assert code == 0 and said == "good\n"


def test_names_that_the_terminal_cannot_show(tmp_path) -> None:
    (tmp_path / "l\udcff\u00fcg.csv").write_bytes(
        Path(LOG).read_bytes()[:4000].rpartition(b"\n")[0]
    )
    line = "run mekf l*g.csv -o ü.csv | cat >&2"
    for encoding in ("ascii", "utf-8"):
        code, said = shell(f"--version >/dev/null; PYTHONIOENCODING={encoding} "
                           f"{' '.join(COMMAND)} {line}", tmp_path)  # fmt: skip
        assert code == 0 and "rows to " in said and "Traceback" not in said
