"""`boresight accuracy`: tables, JSON and page on short logs; what is refused."""

from __future__ import annotations

import dataclasses
import json
import re
import sys

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.sim.accuracy.peers import PEERS
from boresight.sim.accuracy.trials import read_trials
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.files import record_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_multiply
from boresight.verbs.figures.accuracy import accuracy
from tests.support.estimators import ALL
from tests.support.records import write_record

CHOICE = "complementary,vqf_online,madgwick"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs")
    for name, seed in (("a", 1), ("b", 2), ("other", 3), ("none", 4)):
        log = synthetic_log(
            seconds=6,
            rate_hz=50,
            seed=seed,
            gyr_error=SensorError(0.01),
            mag_error=SensorError(1.0),
            name=name,
        )
        (path / name).mkdir()
        held = dataclasses.replace(NineAxis.of(log), q=None).record() if name == "none" else log
        write_record(path / name / f"{name}.csv", held)
    return path


@pytest.fixture(scope="module")
def made(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    result = accuracy(CHOICE, folder, comparisons=["other"], jobs=1, output=out)
    assert json.loads((out / "accuracy.json").read_text()) == result.to_json()
    assert sorted(p.name for p in out.iterdir()) == [
        ".boresight.json",
        "accuracy.html",
        "accuracy.json",
    ]
    return result, (out / "accuracy.html").read_text()


@pytest.fixture(scope="module")
def data(made):
    return made[0]


def near(row):
    return {d.output: d for d in row.vs_float}


def test_references(data):
    assert {log.trial: log.reference for log in data.logs} == {
        "a": "truth",
        "b": "truth",
        "other": "comparison",
        "none": "vqf_offline",
    }
    assert {(log.rate_hz, log.samples) for log in data.logs} == {(50.0, 300)}


def test_means_are_over_truth_alone(data):
    assert [(r.estimator, r.level, r.kind) for r in data.estimators] == [
        ("complementary", "fixed", "ours"),
        ("complementary", "float", "ours"),
        ("vqf_online", "package", "peer"),
        ("madgwick", "package", "peer"),
    ]
    for row in data.estimators:
        true = [t for t in row.trials if t.trial in "ab"]
        assert len(row.trials) == 4 and len(true) == 2
        for key in ("total", "heading", "inclination"):
            assert row.mean[key] == pytest.approx(np.mean([t.error[key] for t in true]))
        assert row.mean_by_folder == {t.trial: pytest.approx(t.error) for t in true}
    fixed = data.estimators[0]
    worst = [t.vs_float["attitude"] for t in fixed.trials]
    assert near(fixed)["attitude"].apart == max(worst) < 1e-3 and min(worst) > 0.0
    assert near(fixed)["status"].apart == 0 == fixed.saturated_updates
    assert data.good and data.estimators[2].vs_float == ()


def test_text(data):
    lines = str(data).splitlines()
    assert "mean over 2 trials with truth" in lines[0]
    fixed = data.estimators[0]
    row = next(line for line in lines if "[1] complementary" in line)
    assert f"{fixed.mean['total']:.2f}" in row and row.endswith("          0")
    assert any(line.startswith("Not truth, outside the means") for line in lines)
    assert any(line.endswith("difference to vqf_offline") for line in lines)
    assert any(line.startswith("Total RMSE, mean by folder") for line in lines)


def test_page(made):
    data, page = made
    assert page.count("<svg") == 5  # means, three groups of trials, fixed against float
    assert "http://" not in page and "<script" not in page
    for word in ("not truth", "difference to vqf_offline", "total RMSE, deg", "mean by folder"):
        assert word in page
    assert f"{data.estimators[3].mean['total']:.2f}" in page


@pytest.mark.parametrize("way", ["heading", "declination"])
def test_a_declination_is_taken_out_or_told(folder, tmp_path, way):
    """North of the reference stands 20 degrees west of the filter's."""
    log = NineAxis.of(record_of(folder / "a" / "a.csv"))
    half = np.radians(-10.0)
    q = quaternion_multiply([np.cos(half), 0.0, 0.0, np.sin(half)], log.q)
    turned = dataclasses.replace(log, q=q).record()
    options = {"align": way} if way == "heading" else {"declination": 20.0}
    plain, off = (
        accuracy(CHOICE, x, jobs=1, output=tmp_path, **more)
        for x, more in ((folder / "a", {}), (turned, options))
    )
    page = (tmp_path / "accuracy.html").read_text()
    for row, other in zip(off.estimators, plain.estimators, strict=True):
        assert row.mean["inclination"] == pytest.approx(other.mean["inclination"])
        if way == "declination":
            assert row.mean == pytest.approx(other.mean)
        else:
            assert row.mean["heading"] < other.mean["heading"] + 1e-9
            (east, north, up) = row.trials[0].offset_deg
            assert east == north == 0.0 and up == pytest.approx(20.0, abs=3.0)
            assert f"{up:.2f}" in page and f"{up:.2f}" in str(off)
    assert "20 deg east" in str(off) or way == "heading"


def test_bundled_logs_by_default():
    trials, left_out = read_trials([], [estimator("complementary")])
    results = {t.name: t.reference for t in trials}
    assert results["synthetic_60s"] == "truth" and results["ximu_walk"] == "comparison"
    assert left_out == []


def test_the_reference_is_not_measured_against_itself(folder, tmp_path):
    data = accuracy(
        ["vqf_online", "vqf_offline"], folder / "none", folder / "a", jobs=1, output=tmp_path
    )
    row = next(line for line in str(data).splitlines() if line.startswith("  none"))
    assert row.split()[2] == "-" and float(row.split()[1]) > 0.0
    page = (tmp_path / "accuracy.html").read_text()
    assert page.count('class="r best"') == 2
    assert 'class="r best" title="vqf_offline: total 0.00' not in page


def test_without_peers_and_float(folder, capsys):
    line = ["accuracy", "complementary", str(folder), "--no-float", "--jobs", "1"]
    assert main([*line, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [r["level"] for r in data["estimators"]] == ["fixed"]
    assert data["left_out"] == ["none"]
    assert data["estimators"][0]["vs_float"] == []
    line[2] = str(folder / "a")
    assert main([*line, "--param", "kp_heading_per_s=5"]) == 0
    shown = capsys.readouterr()
    assert "[1/1] complementary" in shown.err
    total = float(shown.out.splitlines()[4].split()[2])
    assert total != pytest.approx(data["estimators"][0]["trials"][0]["error"]["total"], abs=0.02)


FILES = """
from boresight import Estimator, Input, Output, State


class Lag(Estimator):
    inputs = (Input("x", -10.0, 10.0, "m"),)
    states = (State("y", -10.0, 10.0, "m"),)
    outputs = (Output("y", "m", tolerance=1e-6), Output("twice", "m"), Output("word", "flags"))

    def step(self, x, u, p):
        y = x.y + 0.3 * (u.x - x.y)
        return {"y": y}, {"y": y, "twice": 2.0 * y, "word": 3.0 + 0.0 * u.x}


class Strict(Lag):
    outputs = (Output("y", "m", tolerance=1e-15), *Lag.outputs[1:])
"""


@pytest.fixture
def lag(tmp_path, monkeypatch):
    """A user's estimators, and two logs with truths, in centimetres and with gaps."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lag.py").write_text(FILES)
    for name, seed in (("one", 1), ("two", 2)):
        rng = np.random.default_rng(seed)
        truth = np.cumsum(rng.normal(0.0, 0.05, 300))
        rows = [f"{x},{'' if k % 3 else 100 * y}" for k, (x, y) in enumerate(
            zip(truth + rng.normal(0.0, 0.5, 300), truth, strict=True))]  # fmt: skip
        (tmp_path / f"{name}.csv").write_text("\n".join(["x,y_true[cm]", *rows, ""]))
    return tmp_path


def test_any_estimator_against_truth_in_its_unit(lag, capsys):
    data = accuracy("lag.py:Lag", "one.csv", "two.csv", output="out")
    fixed, floating = data.estimators
    assert data.good and not fixed.attitude and fixed.units == {"y": "m"}
    alone = {}
    for on, row in (("c", fixed), ("float", floating)):
        alone[on] = [
            boresight.run("lag.py:Lag", f"{n}.csv", on=on).truth[0] for n in ("one", "two")
        ]
        assert [t.error["y"] for t in row.trials] == [d.rms for d in alone[on]]
        assert row.mean["y"] == pytest.approx(np.mean([d.rms for d in alone[on]]))
        assert alone[on][0].samples == 100
    y, twice, word = fixed.vs_float
    assert (y.unit, y.tolerance, y.good) == ("m", 1e-6, True) and 0 < y.apart < 1e-7
    assert twice.tolerance is None and (word.unit, word.apart) == ("words", 0)
    assert {log.rate_hz for log in data.logs} == {None}
    page = (lag / "out" / "accuracy.html").read_text()
    assert "<h2>lag</h2>" in page and f"{fixed.mean['y']:.4g}" in page and "<svg" not in page
    text = str(data)
    (line,) = [x for x in text.splitlines() if x.startswith("  y m")]
    assert line.split()[2:4] == [f"{r.mean['y']:.4g}" for r in (fixed, floating)]
    assert "mean over 2 logs" in text and re.search(r"^  two: y 0\.\d+$", text, re.M)


def test_words_that_differ_are_counted_over_all_logs(lag):
    """A state that saturates, and a flag that tells of it: wrong from the fifth sample on."""

    class Full(boresight.Estimator):
        inputs = (boresight.Input("x", -10.0, 10.0, "m"),)
        states = (boresight.State("fill", 0.0, 0.75),)
        outputs = (boresight.Output("y", "m"), boresight.Output("full", "flags"))

        def step(self, x, u, p):
            full = boresight.ops.where(x.fill > 0.9, 1.0, 0.0)
            return {"fill": x.fill + 0.25}, {"y": 0.5 * u.x, "full": full}

    data = accuracy(Full, "one.csv", "two.csv")
    fixed = data.estimators[0]
    assert [t.vs_float["full"] for t in fixed.trials] == [296, 296]
    assert near(fixed)["full"].apart == 592 and not near(fixed)["full"].good
    assert fixed.saturated_updates == 2 * 297 and not data.good


def test_beyond_its_tolerance_fails(lag, capsys):
    assert main(["accuracy", "lag.py:Strict,complementary", "one.csv", "-q"]) == 2  # other columns
    assert "wanted columns t [s] or dt [s], gx [rad/s], " in capsys.readouterr().err
    assert main(["accuracy", "lag.py:Strict", "one.csv", "-q"]) == 1
    text = capsys.readouterr().out
    assert re.search(r"^  y m .* 1e-15  BEYOND$", text, re.M)
    assert main(["accuracy", "lag.py:Strict", "one.csv", "-q", "--no-float"]) == 0


def test_an_attitude_beyond_its_tolerance_fails(folder, capsys):
    line = ["accuracy", "complementary", str(folder / "a"), "--word", "18", "-q"]
    assert main(line) == 1
    assert re.search(r"complementary, attitude: \S+ deg from float64, BEYOND 0\.0115",
                     capsys.readouterr().out)  # fmt: skip


def test_classes_and_objects(lag):
    class Gain(boresight.Estimator):
        inputs = (boresight.Input("x", -10.0, 10.0, "m"),)
        outputs = (boresight.Output("y", "m"),)

        def step(self, x, u, p):
            return {}, {"y": 0.5 * u.x}

    for estimator_like in (Gain, Gain(), [Gain()]):
        assert accuracy(estimator_like, "one.csv").estimators[0].estimator == "gain"


def test_refused(folder, tmp_path):
    log = folder / "a" / "a.csv"
    for names, options, message in (
        ("kalman", {}, r"^estimator: wanted file.py:Class, or one of "),
        ([], {}, r"^estimators: wanted at least one"),
        ("complementary", {"comparisons": ["b"]}, r"--comparison: wanted names of logs"),
        ("complementary", {"jobs": 0}, r"^jobs: wanted 1 to 1,024"),
        ("complementary", {"params": {"complementary": {"kp": 1.0}}}, r"^parameter kp: wanted"),
        ("complementary", {"word": 12}, r"^word: wanted 18 to 32"),
    ):
        with pytest.raises(InputError, match=message):
            accuracy(names, log, **({"jobs": 1} | options))
    with pytest.raises(InputError, match=r"wanted logs of different names, found a;"):
        accuracy("complementary", log, log)
    with pytest.raises(InputError, match=r"^logs: wanted at least one log with a truth"):
        accuracy("complementary", folder / "none")
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(InputError, match=r"a path that can be written"):
        accuracy("complementary", log, jobs=1, output=blocker)


def test_missing_package_is_one_line(folder, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "vqf", None)
    with pytest.raises(InputError):
        accuracy("vqf_online,complementary", folder, jobs=1)
    assert main(["accuracy", "vqf_online", str(folder)]) == 2
    err = capsys.readouterr().err
    assert err == (
        "error: published filters: wanted the Python package vqf, found none; "
        "run 'pip install vqf ahrs' in this Python environment, or leave them out\n"
    )


def test_names_are_apart():
    assert not set(PEERS) & set(ALL)


def test_data_in_memory_gives_what_its_file_does(lag):
    (fixed,) = accuracy("lag.py:Lag", "one.csv", floating=False).estimators
    columns = np.genfromtxt("one.csv", delimiter=",", skip_header=1)
    columns_of_log = {"x": columns[:, 0], "y_true[cm]": columns[:, 1]}
    result = accuracy(
        "lag.py:Lag", columns_of_log, record_of("two.csv"), columns_of_log, floating=False
    )
    assert [log.trial for log in result.logs] == ["record", "record2", "two"]
    assert result.estimators[0].trials[0].error == fixed.trials[0].error
    assert {log.folder for log in result.logs} == {""}
    with pytest.raises(InputError, match=r"^log 'x': wanted logs of different names, found x;"):
        accuracy("lag.py:Lag", *[Record.of(columns_of_log, name="x")] * 2)
