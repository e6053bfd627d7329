"""The simulator's library is compiled once, and anew when anything that decides it changes."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import pytest

from boresight.sim.rtl.runtime_objects import launcher

#: Stands for a compiler: says what it was asked for, "compiles" by copying, fails on "wrong".
COMPILER = """#!/bin/sh
[ "$1" = --version ] && { echo version {version}; exit 0; }
echo "$@" >> {calls}
while [ $# -gt 1 ]; do [ "$1" = -o ] && out=$2; shift; done
grep -q wrong "$1" && exit 3
cp "$1" "$out"
"""


class Builds:
    """A library, a compiler and a cache; counts what reaches the compiler."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.cache = folder, folder / "cache $x"  # as a make variable and a shell word
        self.keep = True
        self.include, self.calls = folder / "include", folder / "calls"
        for new in (self.cache, self.include):
            new.mkdir()
        (self.include / "verilated.h").write_text("header")
        (self.include / "verilated.cpp").write_text("library")
        self.compiler("1")

    def compiler(self, version: str) -> None:
        text = COMPILER.replace("{version}", version).replace("{calls}", str(self.calls))
        (self.folder / "c++").write_text(text)
        (self.folder / "c++").chmod(0o755)

    def make(self, source: str = "verilated.cpp", flags: str = "-O1") -> tuple[int, str]:
        """Exit code of a makefile's rule, text of the object."""
        (self.folder / "Makefile").write_text(
            f"all:\n\t@$(OBJCACHE) {self.folder}/c++ {flags} -c -o x.o {self.include}/{source}\n"
        )
        target = self.folder / "x.o"
        target.unlink(missing_ok=True)
        done = subprocess.run(
            ["make", "-s"],
            cwd=self.folder,
            env={"PATH": "/usr/bin:/bin", "OBJCACHE": launcher(self.cache, keep=self.keep)},
            capture_output=True,
        )
        return done.returncode, target.read_text() if target.exists() else ""

    def count(self) -> int:
        return len(self.calls.read_text().splitlines()) if self.calls.exists() else 0


@pytest.fixture
def builds(tmp_path: Path) -> Builds:
    return Builds(tmp_path)


def test_the_second_build_takes_what_the_first_made(builds: Builds) -> None:
    assert builds.make() == builds.make() == (0, "library")
    assert builds.count() == 1
    assert [path.suffix for path in builds.cache.iterdir()] == [".o"], "nothing else is left"


def test_what_only_takes_leaves_nothing(builds: Builds) -> None:
    builds.keep = False
    assert builds.make() == builds.make() == (0, "library") and builds.count() == 2
    assert not list(builds.cache.iterdir())
    builds.keep = True
    builds.make()
    builds.keep = False
    assert builds.make() == (0, "library") and builds.count() == 3


def test_whatever_decides_the_object_makes_a_new_one(builds: Builds) -> None:
    builds.make()
    builds.make(flags="-O2")
    assert builds.count() == 2
    (builds.include / "verilated.h").write_text("another header")
    builds.make()
    assert builds.count() == 3
    (builds.include / "verilated.cpp").write_text("another library")
    assert builds.make() == (0, "another library") and builds.count() == 4
    builds.compiler("2")
    builds.make()
    assert builds.count() == 5


def test_other_sources_go_to_the_compiler(builds: Builds) -> None:
    (builds.include / "Vbench.cpp").write_text("a bench")
    assert builds.make("Vbench.cpp") == builds.make("Vbench.cpp") == (0, "a bench")
    assert builds.count() == 2 and not list(builds.cache.iterdir())


def test_a_failure_is_one_and_leaves_nothing(builds: Builds) -> None:
    (builds.include / "verilated.cpp").write_text("wrong")
    assert builds.make() == (2, "")
    assert not list(builds.cache.iterdir())


def test_launcher_is_shell_words() -> None:
    words = shlex.split(launcher(Path("/a b/$c"), keep=True).replace("$$", "$"))
    assert words[-2:] == ["keep", "/a b/$c"] and Path(words[-3]).name == "runtime_objects.py"
