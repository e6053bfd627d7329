"""One mutant, or none, in a copy of the tree: which test notices it."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.edits import Mutant

_LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv*", "build", "*.egg-info", "__pycache__", ".*_cache", ".hypothesis"
)
#: Exit codes of pytest: all passed, some failed, a file cannot be imported, none collected.
_PASSED, _FAILED, _BROKEN, _NONE = 0, 1, 2, 5
#: In their place: the time is over; pytest itself failed.
_TIME, _CRASHED = -1000, -1001
#: The most memory that each process of a test may have; a mutant may want all there is.
_DATA_KIB = 8 << 20


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant.

    Attributes
    ----------
    verdict : str
        ``nearest`` or ``wider``: these tests noticed it. ``time``: it took longer than the limit.
        ``survived``. ``error``: the tests could not be run; it counts for nothing.
    by : str
        The first test that failed, or how the tests ended.
    """

    verdict: str
    by: str = ""

    @property
    def noticed(self) -> bool:
        """Whether a test noticed it."""
        return self.verdict in ("nearest", "wider", "time")


def copy_tree(root: Path, place: Path) -> None:
    """A copy of the tree, with its links, without what was made in it."""
    shutil.copytree(root, place, symlinks=True, ignore=_LEFT_OUT, dirs_exist_ok=True)


def run_tests(tree: Path, tests: Sequence[str], limit_s: float, cache: Path) -> tuple[int, str]:
    """(pytest's exit code, first failed test); the code is `_TIME` when the time is over."""
    user_cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    environment = {
        # yosys as it was compiled for this machine: a minute, and the same for all mutants.
        "YOWASP_CACHE_DIR": str(Path(user_cache) / "YoWASP"),
        **os.environ,
        # The copy, also for the processes that tests start; builds of mutants stay out of the
        # user's cache.
        "PYTHONPATH": str(tree),
        "PYTHONDONTWRITEBYTECODE": "1",
        "XDG_CACHE_HOME": str(cache),
    }
    options = ["-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
    limited = ["sh", "-c", f'ulimit -d {_DATA_KIB}; exec "$@"', "sh"]
    process = subprocess.Popen(
        [*limited, sys.executable, "-m", "pytest", *options, *tests],
        cwd=tree,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        text, _ = process.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return _TIME, ""
    failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", text, re.MULTILINE)
    if failed:
        return process.returncode or _FAILED, failed[1]
    if process.returncode == _FAILED:  # something went wrong, but in no test
        return _CRASHED, "no test failed"
    return process.returncode, f"exit code {process.returncode}"


def try_mutant(
    root: Path,
    mutant: Mutant,
    nearest: Sequence[str],
    wider: Sequence[str],
    *,
    limit_s: float,
    cache: Path,
) -> Verdict:
    """Nearest tests first, then one wider group."""
    with tempfile.TemporaryDirectory(prefix="boresight-mutant-") as folder:
        tree = Path(folder)
        copy_tree(root, tree)
        file = tree / mutant.file
        file.write_text(mutant.apply(file.read_text("utf-8")), "utf-8")
        for name, tests in (("nearest", nearest), ("wider", wider)):
            if not tests:
                continue
            code, by = run_tests(tree, tests, limit_s, cache)
            if code == _TIME:
                return Verdict("time")
            if code in (_FAILED, _BROKEN):
                return Verdict(name, by)
            if code not in (_PASSED, _NONE):
                return Verdict("error", by)
    return Verdict("survived")
