"""Compiles the simulator's run-time library once: stands before the compiler in its makefile.

Of a small bench's build, four fifths go into Verilator's own library, the same each time. Its
makefile puts ``OBJCACHE`` before each call of the compiler; this file, run as a program there,
keeps the objects of the library's sources and passes every other call on.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

__all__ = ["launcher"]


def launcher(cache: Path) -> str:
    """Value of ``OBJCACHE`` that keeps objects in ``cache``: shell words, in make's quoting."""
    command = [sys.executable, "-I", "-S", str(Path(__file__).resolve()), str(cache)]
    return shlex.join(command).replace("$", "$$")


def _library(include: Path) -> bytes:
    """Digest of the library: every header and source."""
    digest = hashlib.sha256()
    for path in sorted(include.rglob("*")):
        if path.suffix in (".h", ".cpp"):
            digest.update(f"{path.relative_to(include)}\0".encode() + path.read_bytes() + b"\0")
    return digest.digest()


def _key(command: list[str], include: Path) -> str:
    """Hash of all that decides the object; names of folders do not."""
    compiler = subprocess.run([command[0], "--version"], capture_output=True, check=True).stdout
    flags = [word.replace(str(include), "include") for word in command]
    return hashlib.sha256(
        b"\0".join([compiler, _library(include), *(word.encode() for word in flags)])
    ).hexdigest()[:32]


def _compile(cache: Path, command: list[str]) -> int:
    """Exit code; the object is where the compiler would have put it."""
    source = Path(command[-1])
    if not (source.name.startswith("verilated") and source.suffix == ".cpp" and "-o" in command):
        return subprocess.run(command, check=False).returncode
    place = command.index("-o") + 1
    target = Path(command[place])
    kept = cache / f"runtime-{_key([*command[:place], *command[place + 1 :]], source.parent)}.o"
    if not kept.exists():
        with tempfile.TemporaryDirectory(dir=cache, prefix="build-") as folder:
            made = Path(folder) / "object.o"
            command[place] = str(made)
            code = subprocess.run(command, check=False).returncode
            if code:
                return code
            os.replace(made, kept)
    shutil.copyfile(kept, target)
    return 0


if __name__ == "__main__":
    sys.exit(_compile(Path(sys.argv[1]), sys.argv[2:]))
