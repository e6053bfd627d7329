"""`boresight tune`: on short synthetic logs."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.bundled import bundled
from boresight.sim.records.nine_axis import NineAxis
from boresight.verbs.figures.tune import tune
from tests.support.records import write_record

NAMES = ["kp_pitch_per_s", "kp_roll_per_s", "kp_heading_per_s"]
FAR = dict.fromkeys(NAMES, 20.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs")
    for seed in (1, 2, 3, 4):
        log = synthetic_log(
            seconds=15,
            rate_hz=50,
            seed=seed,
            gyr_error=SensorError(0.01),
            acc_error=SensorError(0.3),
            mag_error=SensorError(3.0),
        )
        if seed == 4:
            log = dataclasses.replace(NineAxis.of(log), name="log4", q=None).record()
        write_record(path / f"log{seed}.csv", log)
    return path


@pytest.fixture(scope="module")
def result(folder):
    return tune("complementary", folder, folds=3, names=NAMES, params=FAR, rounds=4)


def test_it_improves_and_says_what_it_did(result):
    before, after = result.error.given, result.error.tuned
    assert after["total"] < 0.8 * before["total"]
    for key, figures in (("given", before), ("tuned", after)):
        for part in ("total", "heading", "inclination"):
            assert figures[part] == pytest.approx(
                np.mean([getattr(t, key)[part] for t in result.trials])
            )
    assert [t.trial for t in result.trials] == ["log1", "log2", "log3"]
    assert result.without_truth == ("log4",)
    assert "left out, no truth: log4" in str(result)
    assert result.search.history[0] == before["total"]
    assert result.search.history[-1] == pytest.approx(after["total"])
    assert set(result.parameters) >= {*NAMES, "mag_gate"}
    assert [p.name for p in result.tuned_parameters] == NAMES
    assert result.parameters["kp_pitch_per_s"] == result.tuned_parameters[0].tuned != 20.0
    assert result.parameters["ki_heading_per_s2"] == 0.004


def test_folds(result):
    cross = result.cross_validation
    tested = [name for fold in cross.folds for name in fold.test]
    assert sorted(tested) == ["log1", "log2", "log3"]
    for fold in cross.folds:
        assert not set(fold.test) & set(fold.train)
        assert len(fold.train) == 2
    assert cross.mean_test_figure == pytest.approx(np.mean([f.test_figure for f in cross.folds]))
    assert cross.mean_test_figure >= 0.999 * result.error.tuned["total"]


def test_a_fold_is_a_tune_without_its_test_trials(folder, result):
    fold = result.cross_validation.folds[0]
    alone = tune(
        "complementary",
        *(folder / f"{name}.csv" for name in fold.train),
        folds=1,
        names=NAMES,
        params=FAR,
        rounds=4,
        jobs=1,
    )
    assert alone.cross_validation is None
    assert alone.error.tuned["total"] == pytest.approx(fold.train_figure)
    assert {n: alone.parameters[n] for n in NAMES} == fold.parameters
    outside = tune(
        "complementary",
        *(folder / f"{name}.csv" for name in fold.test),
        folds=1,
        names=NAMES,
        params=fold.parameters,
        rounds=1,
    )
    assert outside.error.given["total"] == pytest.approx(fold.test_figure)
    assert fold.test_figure != pytest.approx(fold.train_figure)


def test_sensitivity(folder, result):
    for s in result.sensitivity:
        assert s.low == pytest.approx(0.5 * s.value, rel=1e-3)
        assert s.high == pytest.approx(2.0 * s.value, rel=1e-3)
    s = result.sensitivity[1]
    other = tune(
        "complementary",
        folder,
        folds=1,
        names=NAMES,
        rounds=1,
        params=result.parameters | {s.parameter: s.high},
    )
    assert other.error.given["total"] == pytest.approx(s.at_high)


def test_repeats_itself(folder, result):
    again = tune("complementary", folder, folds=3, names=NAMES, params=FAR, rounds=4, jobs=1)
    assert again == result


def test_detune(folder):
    data = tune("complementary", folder, folds=1, names=NAMES, detune=100.0, rounds=1)
    assert [(p.given, p.start) for p in data.tuned_parameters] == [
        (0.4, 0.004),
        (0.4, 32.0),
        (0.15, 0.0015),
    ]  # the second at its limit
    assert data.error.given["total"] < data.search.start


def test_command_and_its_file(folder, tmp_path, capsys):
    out = tmp_path / "params.json"
    arguments = [
        "tune",
        "complementary",
        str(folder),
        "--folds",
        "1",
        "--only",
        ",".join(NAMES),
        "--rounds",
        "2",
        "-o",
        str(out),
    ]
    assert main(arguments) == 0
    text = capsys.readouterr()
    assert text.out.startswith("complementary, W = 32, 3 trials, ") and "kp_roll_per_s" in text.out
    assert "all trials, round 1 of 2" in text.err
    data = json.loads(out.read_text())
    assert main([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == data
    log = str(folder / "log1.csv")
    assert main(["run", "complementary", log, "--on", "c", "--params", str(out), "--json"]) == 0
    rmse = json.loads(capsys.readouterr().out)["rmse_deg"]
    assert rmse == pytest.approx(data["trials"][0]["tuned"])


FILES = """
from boresight import Estimator, Input, Output, Param, State


class Lag(Estimator):
    inputs = (Input("x", -10.0, 10.0, "m"),)
    params = (Param("k", 0.9, 0.01, 1.0),)
    states = (State("y", -10.0, 10.0, "m"),)
    outputs = (Output("y", "m", tolerance=1e-6), Output("twice", "m", tolerance=1e-6))

    def step(self, x, u, p):
        y = x.y + p.k * (u.x - x.y)
        return {"y": y}, {"y": y, "twice": 2.0 * y}
"""


@pytest.fixture
def lag(tmp_path, monkeypatch):
    """A user's estimator, and logs with truth."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lag.py").write_text(FILES)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        truth = np.cumsum(rng.normal(0.0, 0.05, 300))
        rows = np.column_stack([truth + rng.normal(0.0, 0.5, 300), truth, 200.0 * truth])
        head = "x,y_true,twice_true[cm]"
        np.savetxt(tmp_path / f"log{seed}.csv", rows, delimiter=",", header=head, comments="")
    return tmp_path


def test_any_estimator(lag, capsys):
    single = tune("lag.py", "log0.csv")  # a single trial cannot be held back
    assert tune("lag.py", boresight.record_of("log0.csv")) == single
    assert single.cross_validation is None and single.weights == {"y": 1.0, "twice": 1.0}
    arguments = ["tune", "lag.py:Lag", "log0.csv", "log1.csv", "log2.csv", "--rounds", "6"]
    assert main([*arguments, "--weight", "twice=0"]) == 0
    text = capsys.readouterr().out
    assert "  y m " in text and "y m with x 0.5, x 2" in text and "cross-validated" in text
    assert main([*arguments, "-q"]) == 0
    assert "share of the given, weights y 1, twice 1" in capsys.readouterr().out
    data = tune("lag.py:Lag", "log0.csv", "log1.csv", "log2.csv", weights={"twice": 0.0}, rounds=6)
    assert data.units == {"y": "m", "twice": "m"}
    assert data.error.tuned["y"] < 0.6 * data.error.given["y"]
    assert data.search.history[-1] == pytest.approx(data.error.tuned["y"])
    cross = data.cross_validation
    assert len(cross.folds) == 3
    assert cross.mean_test_error["y"] == pytest.approx(cross.mean_test_figure)
    # The folds' figure is that of a plain run of the held-back log.
    fold = cross.folds[1]
    assert fold.test == ("log1",)
    truth = boresight.run("lag.py", "log1.csv", on="c", params=fold.parameters).truth
    assert truth[0].rms == pytest.approx(fold.test_error["y"])
    assert main([*arguments, "--weight", "z=1"]) == 2
    assert main([*arguments, "--weight", "y=much"]) == 2
    refused = capsys.readouterr().err.splitlines()
    assert refused[-2].startswith("error: weight z: wanted one of y, twice, found 'z'; ")
    assert refused[-1].startswith("error: --weight: wanted NAME=NUMBER, found 'y=much'; ")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"folds": 4}, r"^folds: wanted 2 to 3"),
        ({"folds": 0}, r"^folds: wanted 1 or more, found 0"),
        ({"rounds": -1}, r"^rounds: wanted 0 or more, found -1"),
        ({"vary": 0.8}, r"^vary: wanted 1 to 1000, found 0.8"),
        ({"jobs": 0}, r"^jobs: wanted 1 to 1,024, found 0"),
        ({"detune": 0.5}, r"^detune: wanted 1 to 1000, found 0.5"),
        ({"detune": float("nan")}, r"^detune: wanted 1 to 1000"),
        ({"seed": -1}, r"^seed: wanted 0 or more"),
        ({"names": ["kp"]}, r"^parameter kp: wanted one of"),
        ({"params": {"kp_pitch_per_s": -1.0}}, r"^parameter kp_pitch_per_s: wanted 0 to 32"),
    ],
)
def test_bad_options(folder, options, message):
    with pytest.raises(InputError, match=message):
        tune("complementary", folder, **options)


def test_nothing_to_tune_on(folder, tmp_path):
    with pytest.raises(InputError, match=r"^logs: wanted at least one log with a truth"):
        tune("complementary", bundled("ximu_walk"))  # its attitude is a comparison
    with pytest.raises(InputError, match=r"^logs: wanted at least one log with a truth"):
        tune("complementary", folder / "log4.csv")
    with pytest.raises(InputError, match=r"without any"):
        tune("complementary", tmp_path)
