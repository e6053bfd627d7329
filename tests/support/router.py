"""A stand-in for nextpnr, and whether the program itself is there."""

import importlib.util
import json
import shutil
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from boresight.gateware.synthesis.tools import find_program

REPORT = {"fmax": {"slow": {"achieved": 66.69, "constraint": 100}, "fast": {"achieved": 200.0}}}
FAKE = """#!/bin/sh
'''exec' '{python}' "$0" "$@"
' '''
import json, pathlib, sys
if "--version" in sys.argv:
    print('"nextpnr-ecp5" (Version nextpnr-{version})', file=sys.stderr)
    sys.exit(0)
pathlib.Path({log!r}).write_text(json.dumps(sys.argv[1:]))
{act}
"""


def stand_in(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    program: str = "nextpnr-ecp5",
    version: str = "9.8",
) -> Callable[[str], Callable[[], Any]]:
    """Put a program first on the PATH that does what ``act`` says; the result reads its arguments.

    Clear the cache of `find_program` afterwards.
    """

    def make(act: str) -> Callable[[], Any]:
        path = tmp_path / "bin" / program
        log = tmp_path / f"{program}.log"
        path.parent.mkdir(exist_ok=True)
        path.write_text(FAKE.format(python=sys.executable, act=act, log=str(log), version=version))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PATH", str(path.parent), prepend=":")
        find_program.cache_clear()
        return lambda: json.loads(log.read_text())

    return make


def is_installed(program: str) -> bool:
    """Whether a router is there, on the PATH or as a package."""
    package = f"yowasp_{program.replace('-', '_')}"
    return shutil.which(program) is not None or importlib.util.find_spec(package) is not None
