"""What the system lacks is one line each, with the line that installs it, before anything else."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.model.tools import needs
from tests.support.tree import ROOT

PROGRAMS = ("sh", "env", "make", "gcc", "g++", "cc1", "cc1plus", "as", "perl", "dirname")


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A search path of a few programs; without a package manager, so that nothing is fetched."""
    for name in PROGRAMS:
        program = shutil.which(name)
        if program:
            (tmp_path / name).symlink_to(os.path.realpath(program))
    monkeypatch.setenv("PATH", str(tmp_path))
    return tmp_path


def preflight(purpose: str, capsys: pytest.CaptureFixture[str], *folder: str) -> list[str]:
    """Lines about what is missing; the exit status agrees with them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["needs.py", purpose, *folder])
        status = needs.main()
    lines = capsys.readouterr().err.splitlines()
    assert status == (2 if lines else 0)
    return lines


@pytest.mark.parametrize("name", ["gcc", "g++", "make", "perl"])
def test_a_missing_program(name: str, path: Path, capsys) -> None:
    assert preflight("setup", capsys, "none") == []
    (path / name).unlink()
    (line,) = preflight("setup", capsys, "none")
    assert line.startswith(f"error: {name} not found (")
    assert line.endswith(f"apt-get install {needs.NEEDS[name].packages['apt-get']}")


@pytest.mark.parametrize("name", ["gcc", "g++", "perl"])
def test_a_program_without_its_library(name: str, path: Path, capsys) -> None:
    (path / name).unlink()
    (path / name).write_text("#!/bin/sh\nexit 1\n")
    (path / name).chmod(0o755)
    (line,) = preflight("run", capsys, "none")
    assert line.startswith(f"error: {name} not found (")


def test_a_python_without_venv(path: Path, capsys, monkeypatch) -> None:
    plain = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "ensurepip" else plain(name)
    )
    (line,) = preflight("setup", capsys, "none")
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    assert line.startswith("error: venv not found (the Python environment): ")
    assert line.endswith(f"apt-get install python{version}-venv")


def test_a_python_without_its_library(path: Path, capsys, monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setattr(needs, "_LIBRARY", "libpython9.so.1.0")
    monkeypatch.setattr(needs, "_WHEELS", True)
    (tmp_path / "include").mkdir()
    (tmp_path / "include" / "Python.h").touch()
    assert preflight("run", capsys, "none") == []
    (line,) = preflight("tests", capsys, str(tmp_path))
    assert line.startswith("error: libpython not found (cocotb: benches in Python, and Icarus): ")
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "libpython9.so.1.0").touch()
    assert preflight("tests", capsys, str(tmp_path)) == []


@pytest.mark.parametrize(
    ("manager", "line"),
    [
        ("dnf", "dnf install gcc-c++ iverilog"),
        ("apt-get", "apt-get install g++ iverilog"),
        ("zypper", "apt-get install g++ iverilog"),
    ],
)
def test_line_of_the_package_manager(manager: str, line: str, path: Path, monkeypatch) -> None:
    (path / manager).symlink_to("make")
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    assert needs.install_line("g++", "iverilog") == f"sudo {line}"
    monkeypatch.setattr("os.geteuid", lambda: 0)
    assert needs.install_line("g++", "iverilog") == line


@pytest.mark.parametrize(
    ("python", "message"),
    [
        ("none", "none not found: install Python 3.11 or newer ("),
        ("old", "old is older than 3.11: install Python 3.11 or newer, or name one: make PYTHON="),
        (sys.executable, "g++ not found (simulation in Verilator): "),
    ],
)
def test_make_ends_before_it_begins(python: str, message: str, path: Path, tmp_path: Path) -> None:
    (path / "old").write_text("#!/bin/sh\nexit 1\n")
    (path / "old").chmod(0o755)
    (path / "g++").unlink()
    environment = tmp_path / "environment"
    command = [
        str(path / "make"),
        "--no-print-directory",
        "main",
        f"PYTHON={python}",
        f"VENV={environment}",
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and not environment.exists()
    (line,) = (line for line in done.stderr.splitlines() if not line.startswith("make"))
    assert line.startswith(f"error: {message}")
    assert done.stdout == ""
