"""Tools without dependencies: missing programs, failures, names, types."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.model.tools.c_names import comment, identifier, unique
from boresight.model.tools.external import failure, last_words
from tests.support.tree import ROOT

# --------------------------------------------------------------------------------------------------
# what the system lacks is one line each, with the line that installs it, before anything else

PROGRAMS = ("sh", "env", "make", "gcc", "cc1", "as", "dirname")


def test_make_ends_before_it_begins(tmp_path: Path) -> None:
    for name in PROGRAMS:
        if program := shutil.which(name):
            (tmp_path / name).symlink_to(os.path.realpath(program))
    environment = tmp_path / "environment"
    old = tmp_path / "old"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    for python, message in {
        "none": "none not found: install Python 3.11 or newer (",
        "old": "old is older than 3.11: install Python 3.11 or newer, or name one: make PYTHON=",
        sys.executable: "g++ not found (simulation in Verilator): ",
    }.items():
        done = subprocess.run(
            ["make", "--no-print-directory", "main", f"PYTHON={python}", f"VENV={environment}"],
            cwd=ROOT,
            env={"PATH": str(tmp_path)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 2 and not environment.exists() and done.stdout == ""
        (line,) = (line for line in done.stderr.splitlines() if not line.startswith("make"))
        assert line.startswith(f"error: {message}")


# -- the one line that says why a tool failed, and the log that stays -----------------------------

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
    match = re.fullmatch(
        r"verilator build of core failed: %Error: core.sv:7:3: .* \(log: (.*)\)", said
    )
    assert match and Path(match[1]).read_text() == VERILATOR
    assert failure("verilator build of core failed", VERILATOR) == said
    assert failure("verilator build of core failed", GCC) != said


def test_only_the_newest_logs_stay(cache: Path) -> None:
    for k in range(25):
        failure("tool failed", f"error {k}")
        newest = max((cache / "boresight" / "logs").iterdir(), key=lambda p: p.stat().st_mtime_ns)
        os.utime(newest, (k, k))
    texts = {p.read_text() for p in (cache / "boresight" / "logs").iterdir()}
    assert texts == {f"error {k}" for k in range(5, 25)}


# -- identifiers and comments out of any text -----------------------------------------------------


@pytest.mark.parametrize(
    "name, wanted",
    [
        ("kp_roll", "kp_roll"),
        ("a b-c", "a_b_c"),
        ("_x", "x"),
        ("3d", "n3d"),
        ("", "unnamed"),
        ("__", "unnamed"),
        ("größe", "gr__e"),
        ("int", "int"),
    ],
)
def test_identifier(name: str, wanted: str) -> None:
    assert identifier(name) == wanted


def test_unique() -> None:
    assert unique(["a", "A", "a_2", "b", "a"], reserved=["B"]) == [
        "a",
        "A_2",
        "a_2_2",
        "b_2",
        "a_3",
    ]


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("m/s^2", "m/s^2"),
        ("a */ b /* c", "a *_ b _* c"),
        ("end\\", "end_"),
        ("??/", "__/"),
        ("two\nlines", "two_lines"),
    ],
)
def test_comment(text: str, wanted: str) -> None:
    assert comment(text) == wanted


@given(st.text(alphabet=st.one_of(st.characters(), st.sampled_from("*/\\?\n"))))
def test_comment_is_harmless(text: str) -> None:
    got = comment(text)
    assert got.isprintable()
    assert not any(mark in got for mark in ("*/", "/*", "\\", "??"))
