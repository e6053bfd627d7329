"""The command line: help, errors of one line, exit codes, signals."""

from __future__ import annotations

import ast
import inspect
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import boresight
from boresight import cli
from boresight.cli import main
from boresight.model.errors import ToolMissing
from boresight.verbs import VERBS

BORESIGHT = [sys.executable, "-m", "boresight"]


@pytest.mark.parametrize("verb", VERBS)
def test_help_of_each_verb(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Its summary, every option with a text, and examples."""
    assert main([verb, "--help"]) == 0
    text = capsys.readouterr().out
    words = " ".join(text.split())
    assert words.startswith(f"Usage: boresight {verb} ") and f"boresight {verb} " in words[40:]
    assert "--json" in text
    assert getattr(boresight, verb).__name__ == verb


def test_the_number_of_options() -> None:
    """Users read them all."""
    app = cli.app(*VERBS)
    options = {
        name
        for verb in VERBS
        for argument in app[verb].assemble_argument_collection()
        for name in argument.names
        if name.startswith("--") and argument.show
    }
    assert len(options) <= 45 and len(VERBS) == 12, sorted(options)


def test_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    for words in ([], ["--help"]):
        assert main(words) == 0
        text = capsys.readouterr().out
        assert all(f" {verb} " in text for verb in VERBS)
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == boresight.__version__


USAGE = {
    "chek a.py": "wanted a verb: new, info, compile, check, run, fit, explore, accuracy, tune, "
    "montecarlo, experiment, monitor, found chek; write check",
    "check": "check: wanted ESTIMATOR, found none; see boresight check --help",
    "check mine.py mine.csv --word": "--word: wanted a value, found none; see boresight check "
    "--help",
    "check mine.py mine.csv --wor 20": "check: wanted an option of this verb, found --wor; write "
    "--word; see boresight check --help",
    "check mine.py mine.csv --word x": "--word: wanted a whole number, found 'x'; see boresight "
    "check --help",
    "new a b": "new: wanted no more arguments, found b; see boresight new --help",
    "new a --steps 2": "new: wanted an option of this verb, found --steps; leave it out; see "
    "boresight new --help",
    "check mine.py mine.csv --param k": "--param: wanted NAME=NUMBER, found 'k'; write for "
    "example --param NAME=0.5",
}


@pytest.mark.parametrize("line", USAGE)
def test_usage(line: str, here: Path, refused) -> None:
    assert refused(line) == USAGE[line]


def test_an_error_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "nosuch.py", "log.csv", "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["where"] == "nosuch.py" and error["found"] and error["fix"] and error["message"]


def run_raising(error: BaseException, monkeypatch: pytest.MonkeyPatch) -> int:
    def raising(*words: object, **options: object) -> None:
        raise error

    monkeypatch.setattr("boresight.verbs.info.info", raising)
    monkeypatch.setattr(cli, "_command", lambda name: lambda: raising())
    return main(["info"])


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (ToolMissing("no yosys: pip install it"), 1, "error: no yosys: pip install it\n"),
        (MemoryError(), 1, "error: out of memory"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (FileNotFoundError(2, "No such file", "x.csv"), 2, "error: x.csv: wanted a path"),
        (ZeroDivisionError("by\nzero"), 3, "error: a bug of Boresight, ZeroDivisionError: by zero"),
    ],
)
def test_exit_codes(error, code, text, monkeypatch, capsys) -> None:
    assert run_raising(error, monkeypatch) == code
    out, err = capsys.readouterr()
    assert not out and err.startswith(text) and err.count("\n") == 1


def test_a_bug_shows_its_traceback_on_request(monkeypatch, capsys) -> None:
    monkeypatch.setenv(cli.DEBUG, "1")
    assert run_raising(ZeroDivisionError(), monkeypatch) == 3
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_work(number: int, code: int, here: Path) -> None:
    """In one line, and without files."""
    line = ["check", "mine.py", "mine.csv", "-o", "out"]
    process = subprocess.Popen([*BORESIGHT, *line], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    process.stderr.readline()  # the work has begun
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert err.splitlines()[-1] in ("interrupted", "terminated")
    assert not Path("out").exists()


IMPORT = """
import builtins, signal, time

plain = builtins.__import__

def caught(name, *more):
    if name == "boresight.cli":
        try:
            signal.raise_signal(signal.SIGINT)
            time.sleep(1)
        except BaseException:
            pass
    return plain(name, *more)

builtins.__import__ = caught
from boresight.__main__ import main
main(["info"])
"""


def test_a_signal_in_an_import_that_catches_everything_ends_it() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORT], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_a_closed_pipe_is_no_error(here: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([*BORESIGHT, "info", "mine.py"], stdout=write, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (141, b"")


def test_the_command_line_is_imported_without_numpy() -> None:
    code = "import sys, boresight.__main__; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_two_verbs_in_one_process(here: Path, data) -> None:
    """No option of the first holds for the second."""
    begin = time.perf_counter()
    first = data("check mine.py mine.csv --levels c --to 1s --tolerance pos=9")
    second = data("check mine.py mine.csv --levels c")
    rows = [r["results"][0]["verification"][0]["n_total"] for r in (first, second)]
    assert rows[0] < rows[1] == 400
    assert second["results"][0]["accuracy"]["outputs"][0]["tolerance"] == 1e-4
    assert time.perf_counter() - begin < 60


def test_the_calls_in_the_package_s_docstring_fit_the_verbs() -> None:
    calls = re.findall(r"^    (boresight\.\w+\(.*\))$", boresight.__doc__ or "", re.MULTILINE)
    assert {call.partition("(")[0].removeprefix("boresight.") for call in calls} == {*VERBS}
    for text in calls:
        call = ast.parse(text, mode="eval").body
        assert isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute)
        signature = inspect.signature(getattr(boresight, call.func.attr))
        signature.bind(*call.args, **{k.arg or "": None for k in call.keywords})
