"""`boresight experiment`: targets, runs pooled over seeds, files, and a user's own experiment."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight import Experiment, ExperimentResult, Target
from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs, figures_of, run_cases, spreads_of
from boresight.sim.experiments.targets import targets_of


@pytest.mark.parametrize(
    ("value", "low", "high", "good"),
    [
        (0.5, None, 0.5, True),
        (0.51, None, 0.5, False),
        (1.0, 1.0, 2.0, True),
        (0.9, 1.0, None, False),
        (math.nan, None, None, False),
        (math.inf, 1.0, None, False),
        (7.0, None, None, True),
    ],
)
def test_band(value, low, high, good) -> None:
    target = Target(name="a", source="b", value=value, low=low, high=high)
    assert target.good is good and target.judged is ((low, high) != (None, None))


@pytest.mark.parametrize("given", [{"value": "1"}, {"value": 1.0, "low": 2.0, "high": 1.0}])
def test_a_target_that_no_value_can_meet_is_refused(given) -> None:
    with pytest.raises(InputError, match="^target a: wanted"):
        Target(name="a", source="b", **given)


SOURCE = """
from boresight import Experiment, ExperimentResult, Target


class Mine(Experiment):
    \"\"\"A drive of my own.\"\"\"

    runs = 3
    pages = ("mine.html",)

    def run(self, *, seed, runs, say):
        say(f"{runs} runs from seed {seed}")
        high = %s
        targets = (
            Target(name="error", source="data sheet", value=0.5, high=high, unit="deg"),
            Target(name="rate", source="a paper", value=9.0, high=1.0, binding=False),
            Target(name="gain", source="ours", value=9.0, high=1.0, needs="50 runs"),
        )
        return ExperimentResult(
            figures={"error": 0.5}, targets=targets, details={"seed": seed}, pages={"mine.html": ""}
        )
"""


@pytest.mark.parametrize(("high", "code"), [(0.6, 0), (0.4, 1)])
def test_an_own_experiment(high, code, tmp_path: Path, monkeypatch, capsys) -> None:
    """A missed target fails if it binds; with too few runs it is not judged."""
    monkeypatch.chdir(tmp_path)
    Path("own_drive.py").write_text(SOURCE % high)
    assert main(["experiment", "own_drive.py", "--seed", "7", "-o", "out"]) == code
    out, err = capsys.readouterr()
    assert "3 runs from seed 7" in err and "1 missed that are reported, not binding" in out
    assert "not judged: needs 50 runs" in " ".join(out.split())
    data = json.loads(Path("out/mine.json").read_text())
    assert data["figures"] == {"error": 0.5} and data["details"] == {"seed": 7}
    assert [target["pass"] for target in data["targets"]] == [not code, False, None]
    assert data["good"] is (code == 0) and Path("out/mine.html").exists()


class Broken(Experiment):
    """Gives something else."""

    def run(self, *, seed, runs, say):
        return {"error": 0.5}


class Pageless(Broken):
    """Forgets its page."""

    pages = ("a.html",)

    def run(self, *, seed, runs, say):
        return ExperimentResult(figures={}, targets=())


@pytest.mark.parametrize(
    ("what", "message"),
    [
        (Broken, "wanted a run that gives an ExperimentResult"),
        (Pageless, "wanted the page a.html"),
        ("satcm", "satcom"),
    ],
)
def test_bad_experiments(what, message, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        boresight.experiment(what, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def flown(offset: float, seeds: range) -> Runs:
    values = np.array([offset + seed for seed in seeds], dtype=np.float64)
    return Runs({"a_rms": values, "a_max": values, "mean": values}, each=list(seeds))


@pytest.mark.parametrize(("at_once", "jobs"), [(5, 1), (2, 1), (2, 2)])
def test_runs_are_pooled_however_they_are_distributed(at_once: int, jobs: int) -> None:
    cases = [("low", 0.0, 5), ("high", 10.0, 3)]
    runs = run_cases(flown, cases, seed=1, at_once=at_once, jobs=jobs, say=lambda text: None)
    assert runs["low"].each == [1, 2, 3, 4, 5] and runs["high"].each == [1, 2, 3]
    figures = figures_of(runs, "x_")
    assert figures["x_low_a_rms"] == pytest.approx(11.0**0.5)
    assert figures["x_low_a_max"] == 5.0 and figures["x_high_mean"] == 12.0
    assert spreads_of(runs)["high_mean"] == (11.0, 13.0)


TABLE = """\
figure,name,source,low,high,over,less,unit,reported,runs,prototype
a,error,Table 1,,0.5,,,deg,,,0.4
a,ratio,Table 2,2,,b,,,yes,,
b,count,ours,,,,,,,50,
a,rest,ours,,0.3,,b,,,,
"""


def test_targets_are_a_table(tmp_path: Path) -> None:
    (tmp_path / "targets.csv").write_text(TABLE)
    figures = {"a": 0.3, "b": 0.1}
    error, ratio, count, rest = targets_of(tmp_path, figures, {"a": (0.2, 0.4)}, runs=20)
    assert error.good and error.beside == {"prototype": 0.4} and error.spread == (0.2, 0.4)
    assert ratio.value == pytest.approx(3.0) and ratio.good and not ratio.binding
    assert rest.value == pytest.approx(0.2) and rest.good
    assert count.needs == "50 runs" and not count.judged
