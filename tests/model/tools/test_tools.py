"""Tools without dependencies: missing programs, failures, names, types."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.model.tools.c_names import comment, identifier, unique
from boresight.model.tools.failure import failure, last_words
from boresight.model.tools.typed import Malformed, Within, typed
from tests.support.tree import ROOT

# --------------------------------------------------------------------------------------------------
# what the system lacks is one line each, with the line that installs it, before anything else

PROGRAMS = ("sh", "env", "make", "gcc", "cc1", "as", "perl", "dirname")


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


def test_without_words_there_is_no_log(cache: Path) -> None:
    assert failure("tool failed", "\n") == "tool failed: no message"
    assert list(cache.iterdir()) == []


def test_without_room_there_is_no_log(cache: Path) -> None:
    (cache / "boresight").mkdir()
    (cache / "boresight" / "logs").write_text("")
    assert failure("tool failed", "error: disk full") == "tool failed: error: disk full"


# -- plain data become what the types say, or one error says where they do not --------------------


class Colour(StrEnum):
    RED = "red"


@dataclass(frozen=True)
class Leaf:
    name: str
    bit: Annotated[int, Within(0, 31)] = 0


@dataclass(frozen=True)
class Tree:
    leaves: tuple[Leaf, ...]
    pair: tuple[int, str]
    colour: Colour = Colour.RED
    weight: float | None = None
    missing: float | str | None = None
    limit: Annotated[int | None, Within(-8, 7)] = None
    wet: bool = False
    notes: tuple[str, ...] = field(default_factory=tuple)


GOOD: dict[str, Any] = {"leaves": [{"name": "a"}], "pair": [1, "b"]}


def test_what_may_be_left_out_and_what_is_ignored() -> None:
    assert typed(Tree, {**GOOD, "more": 1}) == Tree((Leaf("a"),), (1, "b"))
    everything = {
        **{"leaves": [{"name": "a", "bit": 31}, {"name": "b"}], "pair": [-1, ""]},
        **{"colour": "red", "weight": 2, "missing": "hold", "limit": -8, "wet": True},
        "notes": ["x"],
    }
    assert typed(Tree, everything) == Tree(
        (Leaf("a", 31), Leaf("b")), (-1, ""), Colour.RED, 2, "hold", -8, True, ("x",)
    )
    assert typed(Tree, {**GOOD, "weight": None, "missing": 0.5, "limit": None}).missing == 0.5


@pytest.mark.parametrize(
    ("data", "place", "value"),
    [
        ([], "", []),
        ({}, ", leaves", None),
        ({**GOOD, "leaves": {}}, ", leaves", {}),
        ({**GOOD, "leaves": [1]}, ", leaves[0]", 1),
        ({**GOOD, "leaves": [{"name": "a"}, {"bit": 1}]}, ", leaves[1], name", None),
        ({**GOOD, "leaves": [{"name": "a", "bit": 32}]}, ", leaves[0], bit", 32),
        ({**GOOD, "leaves": [{"name": "a", "bit": -1}]}, ", leaves[0], bit", -1),
        ({**GOOD, "leaves": [{"name": "a", "bit": True}]}, ", leaves[0], bit", True),
        ({**GOOD, "leaves": [{"name": "a", "bit": 1.0}]}, ", leaves[0], bit", 1.0),
        ({**GOOD, "pair": [1, "b", 2]}, ", pair", [1, "b", 2]),
        ({**GOOD, "pair": [1, 2]}, ", pair[1]", 2),
        ({**GOOD, "colour": "blue"}, ", colour", "blue"),
        ({**GOOD, "colour": None}, ", colour", None),
        ({**GOOD, "weight": "1"}, ", weight", "1"),
        ({**GOOD, "weight": True}, ", weight", True),
        ({**GOOD, "missing": []}, ", missing", []),
        ({**GOOD, "limit": 8}, ", limit", 8),
        ({**GOOD, "wet": 1}, ", wet", 1),
        ({**GOOD, "notes": "ab"}, ", notes", "ab"),
    ],
)
def test_the_place_of_what_does_not_fit(data: Any, place: str, value: Any) -> None:
    with pytest.raises(Malformed) as error:
        typed(Tree, data)
    assert (error.value.location, error.value.value) == (place, value)


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
