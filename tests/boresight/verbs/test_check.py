"""Logs of `boresight check`: shared by all estimators, or one for each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.cli import main
from tests.support.strangers import PROGRAMS, STRANGERS, csv

BOTH = f"{PROGRAMS}/kalman.py,{PROGRAMS}/pi.py:Pi"


@pytest.fixture
def logs(tmp_path: Path) -> list[str]:
    return [
        str(csv(tmp_path / f"{name}.csv", STRANGERS[program](n)))
        for name, program, n in (("cart", "kalman.py", 70), ("motor", "pi.py:Pi", 50))
    ]


def test_a_log_for_each(logs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    cart, motor = logs
    line = ["check", BOTH, f"pi={motor}", f"kalman={cart}", "--simulator", "verilator", "--json"]
    assert main(line) == 0
    first, second = json.loads(capsys.readouterr().out)["results"]
    assert (first["estimator"], first["log"]) == ("kalman", "cart")
    assert (second["estimator"], second["log"]) == ("pi", "motor")
    for result, n in ((first, 70), (second, 50)):
        assert [v["n_total"] for v in result["verification"]] == [n, n, n]


def test_a_mapping_by_estimator() -> None:
    given = {
        name: STRANGERS[program](40)[0]
        for name, program in (("kalman", "kalman.py"), ("pi", "pi.py:Pi"))
    }
    told: list[str] = []
    results = boresight.check(BOTH, given, levels=("fixed", "c"), progress=told.append)
    assert [r.good for r in results] == [True, True]
    assert "record: c in gcc, 80 updates of 2 programs" in told


def test_whose_log_is_missing(logs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", BOTH, f"pi={logs[1]}", "--levels", "fixed"]) == 2
    said = "error: logs: wanted a log of kalman, since pi has its own, found none; write for "
    assert capsys.readouterr().err == f"{said}example kalman=log.csv\n"
    # One that is nobody's is a file of that name.
    assert main(["check", BOTH, f"x={logs[1]}", "--levels", "fixed"]) == 2
    assert "x=" in capsys.readouterr().err


def test_a_shared_log_must_feed_all(logs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", BOTH, logs[0], "--levels", "fixed"]) == 2
    assert "wanted a column target" in capsys.readouterr().err
    columns = STRANGERS["kalman.py"](30)[0] | STRANGERS["pi.py:Pi"](30)[0]
    results = boresight.check(BOTH, columns, levels=("fixed",))
    assert [r.estimator for r in results] == ["kalman", "pi"]
    assert all(len(r.given) == 30 for r in results)
    assert np.array_equal(results[0].given.inputs[:, 0], columns["dt"])
