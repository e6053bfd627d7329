"""`boresight check`: its lines, its JSON; logs that all estimators share, or one for each."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.cli import main
from tests.support.strangers import STRANGERS, csv, program

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.check")

BOTH = f"{program('kalman.py')},{program('pi.py:Pi')}"
HEADER = "t,gx,gy,gz,ax,ay,az,mx,my,mz\n"
ROW = "{t},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40\n"
GOOD = HEADER + "".join(ROW.format(t=k / 100) for k in range(20))


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
    logs = {
        name: STRANGERS[program](40)[0]
        for name, program in (("kalman", "kalman.py"), ("pi", "pi.py:Pi"))
    }
    messages: list[str] = []
    results = boresight.check(BOTH, logs, levels=("fixed", "c"), progress=messages.append)
    assert [r.good for r in results] == [True, True]
    assert "record: c in gcc, 80 updates of 2 programs" in messages


def test_whose_log_is_missing(logs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", BOTH, f"pi.py={logs[1]}", "--levels", "fixed"]) == 2
    said = "error: logs: wanted a log of kalman, since pi has its own, found none; write for "
    assert capsys.readouterr().err == f"{said}example kalman=log.csv\n"
    # A name of no estimator is a file of that name.
    assert main(["check", BOTH, f"x={logs[1]}", "--levels", "fixed"]) == 2
    assert "x=" in capsys.readouterr().err


def test_a_shared_log_must_feed_all(logs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", BOTH, logs[0], "--levels", "fixed"]) == 2
    assert "wanted columns target [rad/s], speed" in capsys.readouterr().err
    columns = STRANGERS["kalman.py"](30)[0] | STRANGERS["pi.py:Pi"](30)[0]
    results = boresight.check(BOTH, columns, levels=("fixed",))
    assert [r.estimator for r in results] == ["kalman", "pi"]
    assert results.good and len(results[:1]) == 1 and results.to_json()["good"] is True
    bad = replace(results, results=(results[0], replace(results[1], levels=())))
    assert (
        not bad.good
        and str(bad).endswith("\nFAILED: pi on record: no level was run")
        and bad.to_json()["good"] is False
    )
    text = str(results).splitlines()
    assert text[0] == "kalman on record, small, W = 32" and text[-1] == "good"
    page = results._repr_html_()
    assert "<td>estimator</td><td>pi</td>" in page and "<th>cycles_predicted</th>" not in page
    assert "<h4>from float64</h4>" in page and "<td>interpreter</td><td>30</td><td>0</td>" in page
    assert all(len(r.given) == 30 for r in results)
    assert np.array_equal(results[0].given.inputs[:, 0], columns["dt"])


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(GOOD)
    return path


def test_check_json_is_one_object(log, capsys):
    assert main(["check", "complementary", str(log), "--levels", "fixed,c", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["good"] is True
    assert [v["n_mismatch"] for v in data["results"][0]["verification"]] == [0, 0]


def test_check_prints_a_line_per_level(log, capsys):
    assert main(["check", "complementary", str(log), "--levels", "fixed,c", "-q"]) == 0
    text = capsys.readouterr().out
    assert text.count("[0/20] mismatches") == 1 and "reference, 20 updates" in text
    assert text.rstrip().endswith("good")


def test_levels_as_a_text_are_those_of_the_command_line(log):
    (result,) = boresight.check("complementary", str(log), levels="fixed,c")
    assert [level.level for level in result.levels] == ["fixed", "c"]


def test_tolerances_that_are_given(log, capsys):
    """They replace the declared ones, in the units of people, and no bit changes."""
    narrow = ["check", "complementary", str(log), "--word", "20", "--levels", "fixed,c", "--json"]
    assert main(narrow) == 1
    declared = json.loads(capsys.readouterr().out)["results"][0]
    assert main([*narrow, "--tolerance", "attitude=0.5deg", "--tolerance", "roll=0.1deg"]) == 0
    given = json.loads(capsys.readouterr().out)["results"][0]
    limits = {d["output"]: d["tolerance"] for d in given["accuracy"]["outputs"]}
    assert limits["attitude"] == pytest.approx(0.5)
    assert limits["qw"] == pytest.approx(np.radians(0.5) / 4.0)
    assert limits["roll"] == pytest.approx(0.1 / 180.0)
    assert [d["max"] for d in given["accuracy"]["outputs"]] == [
        d["max"] for d in declared["accuracy"]["outputs"]
    ]
    assert main([*narrow, "--tolerance", "roll=1e-9", "--tolerance", "attitude=0.5deg"]) == 2
    assert "for the tolerance of output roll" in capsys.readouterr().err
