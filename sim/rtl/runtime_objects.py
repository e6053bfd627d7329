"""Compile the simulator's run-time library once: a wrapper of the compiler in its makefile.

Four fifths of a small bench's build compile Verilator's own library, the same each time. The
makefile puts ``OBJCACHE`` before each call of the compiler; this file, run as that program, reads
or stores the objects of the library's sources in a folder, and passes every other call on.
"""

from __future__ import annotations

import hashlib
import shlex
import shutil
import subprocess
import sys
from pathlib import Path


def launcher(folder: Path, *, keep: bool) -> str:
    """Value of ``OBJCACHE``, in make's quoting; with ``keep`` new objects are stored, too."""
    mode = "keep" if keep else "take"
    command = [sys.executable, "-I", "-S", str(Path(__file__).resolve()), mode, str(folder)]
    return shlex.join(command).replace("$", "$$")


def _library(include: Path) -> bytes:
    """Digest of the library: every header and source."""
    digest = hashlib.sha256()
    for path in sorted(include.rglob("*")):
        if path.suffix in (".h", ".cpp"):
            digest.update(f"{path.relative_to(include)}\0".encode() + path.read_bytes() + b"\0")
    return digest.digest()


def _version(compiler: str) -> bytes:
    return subprocess.run([compiler, "--version"], capture_output=True, check=True).stdout


def _key(command: list[str], include: Path) -> str:
    """Hash of everything that affects the object; names of folders do not."""
    flags = [word.replace(str(include), "include") for word in command]
    return hashlib.sha256(
        b"\0".join([_version(command[0]), _library(include), *(word.encode() for word in flags)])
    ).hexdigest()[:32]


def _compile(mode: str, folder: Path, command: list[str]) -> int:
    """Run or replace one call of the compiler; return its exit code."""
    source = Path(command[-1])
    if not (source.name.startswith("verilated") and source.suffix == ".cpp" and "-o" in command):
        return subprocess.run(command, check=False).returncode
    position = command.index("-o") + 1
    entry = folder / f"{_key([*command[:position], *command[position + 1 :]], source.parent)}.o"
    if entry.exists():
        shutil.copyfile(entry, command[position])
        return 0
    code = subprocess.run(command, check=False).returncode
    if code == 0 and mode == "keep":
        shutil.copyfile(command[position], entry)
    return code


if __name__ == "__main__":
    sys.exit(_compile(sys.argv[1], Path(sys.argv[2]), sys.argv[3:]))
