"""Which sources of a design reach the compiler when Verilator builds it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

#: Stands before the compiler: writes down the command of the process that called it.
_SCRIPT = """#!/bin/sh
if [ "$1" != --version ]; then
  tr '\\0' ' ' < /proc/$PPID/cmdline >> '{log}'
  echo >> '{log}'
fi
exec {compiler} "$@"
"""


def compiler_calls(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[str]]:
    """Put a compiler on the path that notes its calls.

    Returns
    -------
    callable
        Names of the sources that it compiled for designs, in order; what it compiled for
        Verilator's library, which is kept (`sim.rtl.runtime_objects`), is left out.
    """
    folder.mkdir()
    log = folder / "log"
    for name in ("c++", "g++"):
        path = shutil.which(name)
        if path is not None:
            (folder / name).write_text(_SCRIPT.format(log=log, compiler=path))
            (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join([str(folder), os.environ["PATH"]]))

    def sources() -> list[str]:
        calls = [line.split() for line in log.read_text().splitlines()]
        return [
            Path(words[-1]).name
            for words in calls
            if "take" in words and "-c" in words and words[-1].endswith(".cpp")
        ]

    return sources
