"""`boresight accuracy`: tables, JSON and page on short logs; what is refused."""

from __future__ import annotations

import dataclasses
import json
import sys

import numpy as np
import pytest

from boresight.cli import main
from boresight.model.errors import InputError, ToolMissing
from boresight.model.estimators import ESTIMATORS
from boresight.sim.accuracy.peers import PEERS
from boresight.sim.attitude.log import write_log
from boresight.sim.records.bundled import bundled
from boresight.sim.worlds.synthetic import SensorError, synthetic_log
from boresight.verbs.accuracy import accuracy, accuracy_text, params_by_estimator, read_trials

CHOICE = ["complementary", "vqf", "madgwick"]


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
        held = dataclasses.replace(log, q=None) if name == "none" else log
        write_log(path / name / f"{name}.csv", held)
    return path


@pytest.fixture(scope="module")
def data(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    found = accuracy(folder, estimators=CHOICE, comparisons=["other"], jobs=1, output=out)
    assert json.loads((out / "accuracy.json").read_text()) == found
    assert sorted(p.name for p in out.iterdir()) == [
        ".boresight.json",
        "accuracy.html",
        "accuracy.json",
    ]
    found["page"] = (out / "accuracy.html").read_text()
    return found


def test_references(data):
    assert {log["trial"]: log["reference"] for log in data["logs"]} == {
        "a": "truth",
        "b": "truth",
        "other": "comparison",
        "none": "vqf_offline",
    }
    assert {(log["rate_hz"], log["samples"]) for log in data["logs"]} == {(50.0, 300)}


def test_means_are_over_truth_alone(data):
    assert [(r["estimator"], r["level"], r["kind"]) for r in data["estimators"]] == [
        ("complementary", "fixed", "ours"),
        ("complementary", "float", "ours"),
        ("vqf", "package", "peer"),
        ("madgwick", "package", "peer"),
    ]
    for row in data["estimators"]:
        true = [t for t in row["trials"] if t["trial"] in "ab"]
        assert len(row["trials"]) == 4 and len(true) == 2
        for key in ("total", "heading", "inclination"):
            assert row["mean_deg"][key] == pytest.approx(np.mean([t[key] for t in true]))
        assert row["mean_by_folder_deg"] == {
            t["trial"]: pytest.approx({k: t[k] for k in row["mean_deg"]}) for t in true
        }
    fixed = data["estimators"][0]
    worst = [t["vs_float_max_deg"] for t in fixed["trials"]]
    assert fixed["vs_float_max_deg"] == max(worst) < 1e-3 and min(worst) > 0.0
    assert fixed["status_changed"] == 0 == fixed["saturated_updates"]
    assert data["estimators"][2]["vs_float_max_deg"] is None


def test_text(data):
    lines = accuracy_text(data).splitlines()
    assert "mean over 2 trials with truth" in lines[0]
    fixed = data["estimators"][0]
    row = next(line for line in lines if "[1] complementary" in line)
    assert f"{fixed['mean_deg']['total']:.2f}" in row and row.endswith("          0")
    assert any(line.startswith("Not truth, outside the means") for line in lines)
    assert any(line.endswith("difference to vqf_offline") for line in lines)
    assert any(line.startswith("Total RMSE, mean by folder") for line in lines)


def test_page(data):
    page = data["page"]
    assert page.count("<svg") == 5  # means, three groups of trials, fixed against float
    assert "http://" not in page and "<script" not in page
    for word in ("not truth", "difference to vqf_offline", "total RMSE, deg", "mean by folder"):
        assert word in page
    assert f"{data['estimators'][3]['mean_deg']['total']:.2f}" in page


def test_bundled_logs_by_default():
    trials, left_out = read_trials([])
    found = {t.log.name: t.reference for t in trials}
    assert found["synthetic_60s"] == "truth" and found["ximu_walk"] == "comparison"
    assert left_out == []


def test_the_reference_is_not_measured_against_itself(folder, tmp_path):
    data = accuracy(
        folder / "none", folder / "a", estimators=["vqf", "vqf_offline"], jobs=1, output=tmp_path
    )
    row = next(line for line in accuracy_text(data).splitlines() if line.startswith("  none"))
    assert row.split()[2] == "-" and float(row.split()[1]) > 0.0
    page = (tmp_path / "accuracy.html").read_text()
    assert page.count('class="r best"') == 2
    assert 'class="r best" title="vqf_offline: total 0.00' not in page


def test_without_peers_and_float(folder, capsys):
    assert (
        main(
            [
                "accuracy",
                str(folder),
                "--estimators",
                "complementary",
                "--no-peers",
                "--no-float",
                "--jobs",
                "1",
                "--json",
            ]
        )
        == 0
    )
    data = json.loads(capsys.readouterr().out)
    assert [r["level"] for r in data["estimators"]] == ["fixed"]
    assert data["left_out"] == ["none"]
    assert data["estimators"][0]["vs_float_max_deg"] is None
    assert (
        main(
            [
                "accuracy",
                str(folder / "a"),
                "--estimators",
                "complementary",
                "--no-peers",
                "--no-float",
                "--jobs",
                "1",
                "--param",
                "kp_heading_per_s=5",
            ]
        )
        == 0
    )
    shown = capsys.readouterr()
    assert "[1/1] complementary" in shown.err
    total = float(shown.out.splitlines()[4].split()[2])
    assert total != pytest.approx(data["estimators"][0]["trials"][0]["total"], abs=0.02)


def test_parameters_find_their_estimator(tmp_path):
    one, two = tmp_path / "one.json", tmp_path / "two.json"
    one.write_text('{"estimator": "complementary", "parameters": {"mag_gate": 1}}')
    two.write_text('{"mag_gate": 2}')
    both = ["complementary", "complementary_as_printed"]
    assert params_by_estimator(both, [one]) == {"complementary": {"mag_gate": 1.0}}
    assert params_by_estimator(["complementary"], [one, two], ["mag_gate=3"]) == {
        "complementary": {"mag_gate": 3.0}
    }
    assert params_by_estimator(both, [one], ["complementary_as_printed.mag_gate=3"]) == {
        "complementary": {"mag_gate": 1.0},
        "complementary_as_printed": {"mag_gate": 3.0},
    }
    assert params_by_estimator(both) == {} == params_by_estimator(["complementary"])
    for names, files, settings, message in (
        (both, [two], [], r"two.json: wanted parameters of .* found no estimator's name"),
        (both, [], ["mag_gate=1"], r"found no estimator's name"),
        ([], [], ["mag_gate=1"], r"wanted estimators of ours, found none"),
        (["complementary_as_printed"], [one], [], r"found those of complementary;"),
        (["complementary"], [], ["mag_gate=9"], r"wanted 0 to 3.9"),
    ):
        with pytest.raises(InputError, match=message):
            params_by_estimator(names, files, settings)


def test_refused(folder, tmp_path):
    log = folder / "a" / "a.csv"
    for options, message in (
        ({"estimators": ["kalman"]}, r"--estimators: wanted some of complementary"),
        ({"estimators": ["vqf"], "peers": False}, r"found vqf; leave one"),
        ({"estimators": []}, r"wanted at least one"),
        ({"comparisons": ["b"]}, r"--comparison: wanted names of logs"),
        ({"jobs": 0}, r"^jobs: wanted 1 to 1,024"),
        ({"params": {"complementary": {"kp": 1.0}}}, r"^parameter kp: wanted"),
        ({"word": 12}, r"^word: wanted 18 to 32"),
    ):
        with pytest.raises(InputError, match=message):
            accuracy(log, **({"estimators": ["complementary"], "jobs": 1} | options))
    with pytest.raises(InputError, match=r"wanted logs of different names, found a;"):
        accuracy(log, log)
    with pytest.raises(InputError, match=r"^logs: wanted at least one log with a reference"):
        accuracy(folder / "none", peers=False)
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(InputError, match=r"a place that can be written"):
        accuracy(log, estimators=["complementary"], jobs=1, output=blocker)


def test_missing_package_is_one_line(folder, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "vqf", None)
    with pytest.raises(ToolMissing):
        accuracy(folder, estimators=["complementary"], jobs=1)
    assert main(["accuracy", str(folder), "--estimators", "complementary"]) == 1
    err = capsys.readouterr().err
    assert err == (
        "error: the Python package vqf was not found: install it (pip install vqf), or "
        "leave the other filters out with --no-peers.\n"
    )


def test_names_are_apart():
    assert not set(PEERS) & set(ESTIMATORS)
    assert bundled("ximu_walk").exists()
