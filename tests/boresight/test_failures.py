"""How the command line ends when it is stopped, and when it has a bug."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.failures import code_of
from boresight.sim.records.bundled import bundled

pytestmark = pytest.mark.pythons

COMMAND = [sys.executable, "-m", "boresight"]
LOG = str(bundled("synthetic_60s"))
DRIFT = Path(__file__).parents[1] / "support" / "drift.py"


def interrupt(process: int) -> None:
    os.kill(process, signal.SIGINT)


def interrupt_all(session: int) -> None:
    """As a terminal does it."""
    os.killpg(session, signal.SIGINT)


def kill_worker(session: int) -> None:
    """As the system does it when memory runs out."""
    workers = [
        p for p in members(session) if b"spawn_main" in Path(f"/proc/{p}/cmdline").read_bytes()
    ]
    os.kill(workers[0], signal.SIGKILL)


def stopped(
    argv: list[str], tmp_path: Path, *, after: str, by: Callable[[int], None]
) -> tuple[int, str]:
    """Exit code and stderr of a command that something happens to after a line of progress."""
    with subprocess.Popen(
        [*COMMAND, *argv],
        cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # not as in the background
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")},
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if after in line:
                break
        time.sleep(1.0)
        by(process.pid)
        said = process.stderr.read()
        code = process.wait(timeout=60)
    for _ in range(50):
        if not members(process.pid):
            break
        time.sleep(0.1)
    assert members(process.pid) == []
    return code, said


def members(session: int) -> list[int]:
    """Processes of a session that still run."""
    results = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, _, of = stat.read_text().rpartition(")")[2].split()[:4]
            if int(of) == session and state != "Z":
                results.append(int(stat.parent.name))
    return results


STOPPED = (
    (["accuracy", "published", LOG, "--jobs", "2"], "[1/"),
    (["check", "complementary", LOG, "--levels", "rtl"], "rtl in verilator"),
    (["montecarlo", f"{DRIFT}:Constant", f"{DRIFT}:Mean", "--runs", "100000"], "of 100000 "),
    (["tune", "mekf", LOG, LOG, "--folds", "1", "--jobs", "2"], "; C"),
)


@pytest.mark.pythons
@pytest.mark.parametrize(
    ("argv", "after", "by"),
    [
        *((argv, after, interrupt_all) for argv, after in STOPPED),
        # The command's own children: workers of a pool, and a simulator. The others have workers.
        *((argv, after, interrupt) for argv, after in STOPPED[:2]),
        *(pytest.param(*case, interrupt, marks=pytest.mark.soak) for case in STOPPED[2:]),
    ],
)
def test_ctrl_c(argv: list[str], after: str, by: Callable[[int], None], tmp_path) -> None:
    code, said = stopped(argv, tmp_path, after=after, by=by)
    assert code == 130 and "Traceback" not in said
    assert said.splitlines()[-1] == "interrupted" and said.count("interrupted") == 1


#: Ends with Ctrl-C where a module is imported that takes long.
IMPORTING = """
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "numpy":
            os.kill(os.getpid(), signal.SIGINT)
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Finder())
from boresight.__main__ import main
sys.exit(main(["list"]))
"""


@pytest.mark.pythons
def test_ctrl_c_while_modules_are_imported() -> None:
    result = subprocess.run([sys.executable, "-c", IMPORTING], capture_output=True, text=True)
    assert (result.returncode, result.stdout, result.stderr) == (130, "", "interrupted\n")


@pytest.mark.pythons
def test_a_worker_is_killed(tmp_path) -> None:
    code, said = stopped(STOPPED[0][0], tmp_path, after="[1/", by=kill_worker)
    assert code == 1 and "Traceback" not in said
    assert re.fullmatch("error: a worker process was killed by signal 9.*", said.splitlines()[-1])


def test_a_bug_says_that_it_is_one(monkeypatch, capsys) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("by\nnothing")

    monkeypatch.setattr("boresight.verbs.list.offered", broken)
    assert main(["list"]) == 3
    said = capsys.readouterr().err
    assert said.startswith(
        "error: a bug of Boresight, ZeroDivisionError: by nothing (test_failures.py"
    )
    assert said.count("\n") == 1 and "BORESIGHT_DEBUG=1" in said
    monkeypatch.setenv("BORESIGHT_DEBUG", "1")
    assert main(["list"]) == 3
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (MemoryError(), 1, "error: out of memory"),
        (PermissionError(13, "Permission denied", "a.csv"), 2, "a.csv: wanted something that can"),
        (OSError("odd"), 3, "a bug of Boresight, OSError: odd"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
    ],
)
def test_other_ends(error: BaseException, code: int, words: str, monkeypatch, capsys) -> None:
    def broken(*_: object) -> None:
        raise error

    monkeypatch.setattr("boresight.verbs.list.offered", broken)
    before = signal.getsignal(signal.SIGINT)
    assert main(["list"]) == code
    assert words in capsys.readouterr().err
    assert signal.getsignal(signal.SIGINT) is before


def test_gateware_that_an_error_left_unused_is_not_mentioned(capsys) -> None:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        assert code_of(KeyboardInterrupt()) == 130
        warnings.warn("<core.Core object at 0x0> created but never used", stacklevel=1)
    assert not seen and capsys.readouterr().err == "interrupted\n"
