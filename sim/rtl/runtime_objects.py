"""Compiles the simulator's run-time library once: stands before the compiler in its makefile.

Of a small bench's build, four fifths go into Verilator's own library, the same each time. Its
makefile puts ``OBJCACHE`` before each call of the compiler; this file, run as a program there,
takes the objects of the library's sources from a folder, or puts them there, and passes every other
call on.
"""

from __future__ import annotations

import hashlib
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

__all__ = ["launcher"]


def launcher(folder: Path, *, keep: bool) -> str:
    """Value of ``OBJCACHE``, shell words in make's quoting.

    Parameters
    ----------
    folder : Path
        Of the objects.
    keep : bool
        Put them there; else only take what is there.
    """
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


def _key(command: list[str], include: Path) -> str:
    """Hash of all that decides the object; names of folders do not."""
    compiler = subprocess.run([command[0], "--version"], capture_output=True, check=True).stdout
    flags = [word.replace(str(include), "include") for word in command]
    return hashlib.sha256(
        b"\0".join([compiler, _library(include), *(word.encode() for word in flags)])
    ).hexdigest()[:32]


def _compile(mode: str, folder: Path, command: list[str]) -> int:
    """Exit code; the object is where the compiler would have put it."""
    source = Path(command[-1])
    if not (source.name.startswith("verilated") and source.suffix == ".cpp" and "-o" in command):
        return subprocess.run(command, check=False).returncode
    place = command.index("-o") + 1
    kept = folder / f"{_key([*command[:place], *command[place + 1 :]], source.parent)}.o"
    if kept.exists():
        shutil.copyfile(kept, command[place])
        return 0
    code = subprocess.run(command, check=False).returncode
    if code == 0 and mode == "keep":
        shutil.copyfile(command[place], kept)
    return code


if __name__ == "__main__":
    sys.exit(_compile(sys.argv[1], Path(sys.argv[2]), sys.argv[3:]))
