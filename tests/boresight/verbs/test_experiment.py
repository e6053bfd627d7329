"""The verb: files, exit codes, progress, one-line errors. The experiment itself is a stand-in."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

import boresight
from boresight.cli import main
from boresight.sim.attitude.ma2014.experiment import Ma2014
from boresight.sim.experiments.experiment import Result, Target
from boresight.verbs.experiment import ExperimentResult


def target(name, value, source, **more):
    return Target(name=name, value=value, source=source, high=0.6, **more)


RESULT = Result(
    figures={"sd, deg": 0.5},
    targets=(
        target("one", 0.5, "Table 3", part="x", unit="deg"),
        target("one", 0.25, "Table 3", part="y", unit="deg"),
        target("two", 1.0, "Figure 7", binding=False),
        Target(name="beside", value=3.0, source="ours"),
    ),
    details={"curve": [1, 2]},
    pages={"ma2014.html": "<html></html>\n"},
)


@pytest.fixture
def stand_in(monkeypatch):
    """An experiment that takes no time: what it gives, and how it was called."""
    calls, results = [], [RESULT]

    def run(self, *, seed, runs, say):
        calls.append((seed, runs))
        say("half way")
        return results[-1]

    monkeypatch.setattr(Ma2014, "run", run)
    return results, calls


def test_writes_page_and_json_and_reports_targets(stand_in, tmp_path, capsys):
    out = tmp_path / "new" / "folder"
    assert main(["experiment", "ma2014", "-o", str(out), "--seed", "7"]) == 0
    names = [".boresight.json", "ma2014.html", "ma2014.json"]
    assert sorted(p.name for p in out.iterdir()) == names
    assert (out / "ma2014.html").read_text() == "<html></html>\n"
    written = json.loads((out / "ma2014.json").read_text())
    assert written["details"] == {"curve": [1, 2]} and written["figures"] == {"sd, deg": 0.5}
    assert stand_in[1] == [(7, 100)]
    text = capsys.readouterr()
    assert "half way" in text.err and "half way" not in text.out
    assert "pass  one (Table 3): 0.5 / 0.25 deg\n" in text.out
    assert "miss  two (Figure 7): 1, wanted at most 0.6\n" in text.out
    assert "      beside (ours): 3\n" in text.out
    assert (
        "targets met: 2 of 3; 1 missed that are reported, not binding" in text.out
        and str(out / "ma2014.html") in text.out
    )


def test_json_alone_on_stdout(stand_in, tmp_path, capsys):
    assert main(["experiment", "ma2014", "-o", str(tmp_path), "--runs", "3", "--json"]) == 0
    text = capsys.readouterr()
    assert text.err == "half way\n" and stand_in[1] == [(1, 3)]
    data = json.loads(text.out)
    assert data == {
        "experiment": "ma2014",
        "figures": {"sd, deg": 0.5},
        "targets": [t.to_json() for t in RESULT.targets],
        "files": [str(tmp_path / "ma2014.json"), str(tmp_path / "ma2014.html")],
    }
    result = boresight.experiment("ma2014", output=tmp_path)
    assert data == result.to_json() and result.targets == RESULT.targets


def test_quiet(stand_in, tmp_path, capsys):
    assert main(["experiment", "ma2014", "-o", str(tmp_path), "-q"]) == 0
    assert capsys.readouterr().err == ""


def test_a_missed_target_that_binds_is_exit_code_1(stand_in, tmp_path, capsys):
    stand_in[0].append(replace(RESULT, targets=(target("C equals", 1.0, "bit for bit"),)))
    assert main(["experiment", "ma2014", "-o", str(tmp_path)]) == 1
    assert "FAIL  C equals (bit for bit): 1, wanted at most 0.6\n" in capsys.readouterr().out


def test_a_band_of_more_runs_is_not_judged():
    few = Target(name="spread", source="ours", value=1.0, low=3.0, fewest=100)
    result = ExperimentResult("e", {}, (few,), ())
    assert result.good and str(result).splitlines() == [
        "      spread (ours): 1, not judged with fewer than 100 runs",
        "targets met: 0 of 0",
    ]


def test_an_experiment_in_a_file(tmp_path, capsys):
    path = tmp_path / "mine.py"
    path.write_text(
        "from boresight import Experiment, Result, Target\n\n\n"
        "class Mine(Experiment):\n"
        "    runs = 4\n\n"
        "    def run(self, *, seed, runs, say):\n"
        "        met = Target(name='runs', source='mine', value=runs, low=4)\n"
        "        return Result(figures={'seed': seed}, targets=(met,))\n"
    )
    assert main(["experiment", f"{path}:Mine", "-o", str(tmp_path / "out"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["experiment"] == "mine" and data["figures"] == {"seed": 1}
    assert data["targets"][0]["limit"] == [4, None] and data["targets"][0]["pass"]
    assert data["files"] == [str(tmp_path / "out" / "mine.json")]


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("run(self, *, seed, runs, say): 1 / 0", "mine.py, line 5: wanted a run that gives a "
         "Result, found ZeroDivisionError: division by zero; correct it"),
        ("run(self, *, seed, runs, say): pass", "experiment mine: wanted a run that gives a "
         "Result, found NoneType; return Result("),
        ("run(self, seed): pass", "'runs'; write run(self, *, seed, runs, say)"),
        ("go(self): pass", "experiment mine: wanted a method run, found none; write it"),
        ("run(self, **_): return Result(figures={'a': 1 / 3 * float('nan')}, targets=())",
         "figures or details of its result: wanted plain data: finite numbers"),
        ("run(self, **_): return Result(figures={}, targets=5)", "found targets of type int"),
        ("run(self, **_): return Result(figures=5, targets=())", "found figures of type int"),
        ("pages = ('a.html',)\n    def run(self, **_): return Result(figures={}, targets=())",
         "wanted the page a.html, found none"),
    ],
)  # fmt: skip
def test_experiments_that_give_no_result(method, message, tmp_path, capsys):
    path = tmp_path / "mine.py"
    method = method if method.startswith("pages") else f"def {method}"
    head = "from boresight import Experiment, Result\n\n\nclass Mine(Experiment):\n"
    path.write_text(f"{head}    {method}\n")
    assert main(["experiment", str(path), "-o", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
