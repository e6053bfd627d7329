"""The one line that says why a tool failed, and the log that stays."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from boresight.model.tools.failure import failure, last_words

GCC = """In file included from a.c:1:
a.c: In function 'f':
a.c:3:5: error: expected ';' before '}' token
    3 | }
compilation terminated.
"""
VERILATOR = """- V e r i l a t i o n
%Error: core.sv:7:3: syntax error, unexpected endmodule
        ... See the manual at https://verilator.org
%Error: Exiting due to 1 error(s)
%Error: Command Failed /x/verilator_bin --cc
"""
LAUNCHER = "sh: 1: /tmp/my: not found\n%Error: Command Failed ulimit -s unlimited; exec /tmp/my\n"
MAKE = """c++ -c a.cpp
/usr/bin/ld: cannot find -lnothing: No such file or directory
collect2: error: ld returned 1 exit status
make: *** [Vtop.mk:70: program] Error 1
"""
TRACEBACK = """Traceback (most recent call last):
  File "x.py", line 1, in <module>
OSError: [Errno 28] No space left on device
"""


@pytest.mark.parametrize(
    ("output", "line"),
    [
        (GCC, "a.c:3:5: error: expected ';' before '}' token"),
        (VERILATOR, "%Error: core.sv:7:3: syntax error, unexpected endmodule"),
        (LAUNCHER, "sh: 1: /tmp/my: not found"),
        (MAKE, "/usr/bin/ld: cannot find -lnothing: No such file or directory"),
        (TRACEBACK, "OSError: [Errno 28] No space left on device"),
        ("a.c:1: error: first\na.c:2: error: second\n", "a.c:1: error: first"),
        ("half done\nmake: *** [x] Error 1\n", "half done"),
        ("make: *** [x] Error 1\n", "make: *** [x] Error 1"),
        ("one\n  two   three \n\n", "two three"),
        (" \n", "no message"),
    ],
)
def test_last_words(output: str, line: str) -> None:
    assert last_words(output) == line


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


def test_the_log_stays(cache: Path) -> None:
    said = failure("verilator build of core failed", VERILATOR)
    found = re.fullmatch(
        r"verilator build of core failed: %Error: core.sv:7:3: .* \(log: (.*)\)", said
    )
    assert found and Path(found[1]).read_text() == VERILATOR
    assert failure("verilator build of core failed", VERILATOR) == said
    assert failure("verilator build of core failed", GCC) != said


def test_only_the_newest_logs_stay(cache: Path) -> None:
    for k in range(25):
        failure("tool failed", f"error {k}")
        newest = max((cache / "boresight" / "logs").iterdir(), key=lambda p: p.stat().st_mtime_ns)
        os.utime(newest, (k, k))
    kept = {p.read_text() for p in (cache / "boresight" / "logs").iterdir()}
    assert kept == {f"error {k}" for k in range(5, 25)}


def test_without_words_there_is_no_log(cache: Path) -> None:
    assert failure("tool failed", "\n") == "tool failed: no message"
    assert list(cache.iterdir()) == []


def test_without_room_there_is_no_log(cache: Path) -> None:
    (cache / "boresight").mkdir()
    (cache / "boresight" / "logs").write_text("")
    assert failure("tool failed", "error: disk full") == "tool failed: error: disk full"
