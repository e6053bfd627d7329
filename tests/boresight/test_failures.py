"""How the command line ends when it is stopped, and when it has a bug."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.sim.records.bundled import bundled

pytestmark = pytest.mark.pythons

COMMAND = [sys.executable, "-m", "boresight"]
LOG = str(bundled("synthetic_60s"))
DRIFT = Path(__file__).parents[1] / "support" / "drift.py"


def stopped(argv: list[str], tmp_path: Path, *, after: str, everybody: bool) -> tuple[int, str]:
    """Exit code and stderr of a command that gets Ctrl-C after a line of progress."""
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
        if everybody:  # as a terminal does it
            os.killpg(process.pid, signal.SIGINT)
        else:
            process.send_signal(signal.SIGINT)
        said = process.stderr.read()
        code = process.wait(timeout=60)
    for _ in range(50):
        if not alive(process.pid):
            break
        time.sleep(0.1)
    assert alive(process.pid) == []
    return code, said


def alive(session: int) -> list[str]:
    """Processes of a session that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            name, _, rest = stat.read_text().rpartition(")")
            state, _, _, of = rest.split()[:4]
            if int(of) == session and state != "Z":
                found.append(name)
    return found


STOPPED = (
    (["accuracy", "published", LOG, "--jobs", "2"], "[1/"),
    (["check", "complementary", LOG, "--levels", "rtl"], "rtl in verilator"),
    (["montecarlo", f"{DRIFT}:Constant", f"{DRIFT}:Mean", "--runs", "100000"], "of 100000 "),
    (["tune", "mekf", LOG, LOG, "--folds", "1", "--jobs", "2"], "; C"),
)


@pytest.mark.parametrize(
    ("argv", "after", "everybody"),
    [
        *((argv, after, True) for argv, after in STOPPED),
        # The command's own children: workers of a pool, and a simulator. The others have workers.
        *((argv, after, False) for argv, after in STOPPED[:2]),
        *(pytest.param(*one, False, marks=pytest.mark.soak) for one in STOPPED[2:]),
    ],
)
def test_ctrl_c(argv: list[str], after: str, everybody: bool, tmp_path) -> None:
    code, said = stopped(argv, tmp_path, after=after, everybody=everybody)
    assert code == 130 and "Traceback" not in said
    assert said.splitlines()[-1] == "interrupted" and said.count("interrupted") == 1


def test_a_bug_says_that_it_is_one(monkeypatch, capsys) -> None:
    def broken() -> None:
        raise ZeroDivisionError("by\nnothing")

    monkeypatch.setattr("boresight.verbs.list.list_estimators", broken)
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
        (MemoryError(), 1, "error: memory ran out"),
        (PermissionError(13, "Permission denied", "a.csv"), 2, "a.csv: wanted something that can"),
        (OSError("odd"), 3, "a bug of Boresight, OSError: odd"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
    ],
)
def test_other_ends(error: BaseException, code: int, words: str, monkeypatch, capsys) -> None:
    def broken() -> None:
        raise error

    monkeypatch.setattr("boresight.verbs.list.list_estimators", broken)
    before = signal.getsignal(signal.SIGINT)
    assert main(["list"]) == code
    assert words in capsys.readouterr().err
    assert signal.getsignal(signal.SIGINT) is before
