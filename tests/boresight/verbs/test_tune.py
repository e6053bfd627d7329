"""`boresight tune`: on short synthetic logs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.records.bundled import bundled
from boresight.sim.worlds.synthetic import SensorError, synthetic_log
from boresight.verbs.tune import tune, tuning_text
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
            log = type(log)("log4", log.t, log.gyr, log.acc, log.mag, log.mag_new)
        write_record(path / f"log{seed}.csv", log)
    return path


@pytest.fixture(scope="module")
def result(folder):
    return tune("complementary", folder, folds=3, names=NAMES, params=FAR, rounds=4)


def test_it_improves_and_says_what_it_did(result):
    before, after = result["rmse_deg"]["given"], result["rmse_deg"]["tuned"]
    assert after["total"] < 0.8 * before["total"]
    for key, figures in (("given", before), ("tuned", after)):
        for part in ("total", "heading", "inclination"):
            assert figures[part] == pytest.approx(np.mean([t[key][part] for t in result["trials"]]))
    assert [t["trial"] for t in result["trials"]] == ["log1", "log2", "log3"]
    assert result["without_truth"] == ["log4"]
    assert result["search"]["history_deg"][0] == before["total"]
    assert result["search"]["history_deg"][-1] == pytest.approx(after["total"])
    assert set(result["parameters"]) >= {*NAMES, "mag_gate"}
    assert [p["name"] for p in result["tuned_parameters"]] == NAMES
    assert result["parameters"]["kp_pitch_per_s"] == result["tuned_parameters"][0]["tuned"] != 20.0
    assert result["parameters"]["ki_heading_per_s2"] == 0.004


def test_folds(result):
    cross = result["cross_validation"]
    tested = [name for fold in cross["folds"] for name in fold["test"]]
    assert sorted(tested) == ["log1", "log2", "log3"]
    for fold in cross["folds"]:
        assert not set(fold["test"]) & set(fold["train"])
        assert len(fold["train"]) == 2
    assert cross["mean_test_deg"] == pytest.approx(np.mean([f["test_deg"] for f in cross["folds"]]))
    assert cross["mean_test_deg"] >= 0.999 * result["rmse_deg"]["tuned"]["total"]


def test_a_fold_is_a_tune_without_its_test_trials(folder, result):
    fold = result["cross_validation"]["folds"][0]
    alone = tune(
        "complementary",
        *(folder / f"{name}.csv" for name in fold["train"]),
        folds=1,
        names=NAMES,
        params=FAR,
        rounds=4,
        jobs=1,
    )
    assert alone["cross_validation"] is None
    assert alone["rmse_deg"]["tuned"]["total"] == pytest.approx(fold["train_deg"])
    assert {n: alone["parameters"][n] for n in NAMES} == fold["parameters"]
    outside = tune(
        "complementary",
        *(folder / f"{name}.csv" for name in fold["test"]),
        folds=1,
        names=NAMES,
        params=fold["parameters"],
        rounds=1,
    )
    assert outside["rmse_deg"]["given"]["total"] == pytest.approx(fold["test_deg"])
    assert fold["test_deg"] != pytest.approx(fold["train_deg"])


def test_sensitivity(folder, result):
    for s in result["sensitivity"]:
        assert s["half"] == pytest.approx(0.5 * s["value"], rel=1e-3)
        assert s["double"] == pytest.approx(2.0 * s["value"], rel=1e-3)
    s = result["sensitivity"][1]
    other = tune(
        "complementary",
        folder,
        folds=1,
        names=NAMES,
        rounds=1,
        params=result["parameters"] | {s["parameter"]: s["double"]},
    )
    assert other["rmse_deg"]["given"]["total"] == pytest.approx(s["double_deg"])


def test_repeats_itself(folder, result):
    again = tune("complementary", folder, folds=3, names=NAMES, params=FAR, rounds=4, jobs=1)
    assert again == result


def test_detune(folder):
    data = tune("complementary", folder, folds=1, names=NAMES, detune=100.0, rounds=1)
    assert [(p["given"], p["start"]) for p in data["tuned_parameters"]] == [
        (0.4, 0.004),
        (0.4, 32.0),
        (0.15, 0.0015),
    ]  # the second at its limit
    assert data["rmse_deg"]["given"]["total"] < data["search"]["start_deg"]


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
    assert text.out.startswith("complementary, W = 32, 3 trials") and "kp_roll_per_s" in text.out
    assert "all trials, round 1 of 2" in text.err
    data = json.loads(out.read_text())
    assert main([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == data
    log = str(folder / "log1.csv")
    assert main(["run", "complementary", log, "--on", "c", "--params", str(out), "--json"]) == 0
    rmse = json.loads(capsys.readouterr().out)["rmse_deg"]
    assert rmse == pytest.approx(data["trials"][0]["tuned"])
    assert "left out, no truth: log4" in tuning_text(data)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"folds": 4}, r"^folds: wanted 2 to 3"),
        ({"folds": 0}, r"^folds: wanted 1 or more, found 0"),
        ({"rounds": 0}, r"^rounds: wanted 1 or more, found 0"),
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
    with pytest.raises(InputError, match=r"^logs: wanted at least one log with a reference"):
        tune("complementary", bundled("ximu_walk"))  # its attitude is a comparison
    with pytest.raises(InputError, match=r"^logs: wanted at least one log with a reference"):
        tune("complementary", folder / "log4.csv")
    with pytest.raises(InputError, match=r"without any"):
        tune("complementary", tmp_path)
