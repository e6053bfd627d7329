"""`boresight accuracy`: figures against an independent computation, logs and what is refused."""

from __future__ import annotations

import dataclasses
import json
import sys

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, Output
from boresight.cli import main
from boresight.model.attitude.complementary import Complementary
from boresight.model.errors import InputError, ToolMissing
from boresight.sim.accuracy.runs import run_peer
from boresight.sim.attitude.worlds import synthetic_log, white
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import quaternion_multiply
from boresight.verbs.accuracy import FIRST
from tests.support.compiled_float import numpy_float
from tests.support.records import write_record
from tests.support.rmse import attitude_rmse


def noisy(seconds: int, seed: int) -> Record:
    return synthetic_log(
        seconds=seconds,
        rate_hz=50,
        seed=seed,
        name=f"log{seed}",
        acceleration=0.5,
        gyr_error=white(0.01),
        acc_error=white(0.1),
        mag_error=white(0.5),
    )


@pytest.fixture(scope="module")
def logs() -> list[Record]:
    return [noisy(4, 1), noisy(6, 2), noisy(5, 3)]


@pytest.fixture(scope="module")
def folder(logs, tmp_path_factory):
    path = tmp_path_factory.mktemp("logs")
    for log in logs[:2]:
        (path / log.name).mkdir()
        write_record(path / log.name / "log.csv", log)
    (path / "none").mkdir()
    blind = dataclasses.replace(NineAxis.of(logs[2]), q=None).record()
    write_record(path / "none" / "blind.csv", blind)
    return path


def rows(result):
    return {(row["estimator"], row["level"]): row for row in result["estimators"]}


def test_figures_are_those_of_plain_runs(logs) -> None:
    params = {"complementary": {"kp_heading_per_s": 0.7}}
    given = [NineAxis.of(log) for log in logs]
    result = boresight.accuracy("complementary,vqf_online", *logs, jobs=1, params=params)
    of = rows(result)
    names = ("complementary", "fixed"), ("complementary", "float"), ("vqf_online", "package")
    assert tuple(of) == names and result.good
    fixed, floating, peer = of.values()
    for k, (log, nine) in enumerate(zip(logs, given, strict=True)):
        inputs = feed(Complementary(), log).inputs[:, :, None]
        real = numpy_float(Complementary(), inputs, params=params["complementary"])
        q = attitude_of({name: v[:, 0] for name, v in real.items()})
        error = floating["trials"][k]["error"]
        assert error == pytest.approx(attitude_rmse(q, nine.attitude)._asdict())
        assert fixed["trials"][k]["error"] == pytest.approx(error, abs=1e-3)
        assert 0.0 < fixed["trials"][k]["vs_float"]["attitude"] < 1e-3
        q = run_peer("vqf_online", log)
        assert peer["trials"][k]["error"] == attitude_rmse(q, nine.attitude)._asdict()
    for row in of.values():
        each = [trial["error"]["total"] for trial in row["trials"]]
        assert row["mean"]["total"] == pytest.approx(np.mean(each))
    assert fixed["saturated_updates"] == 0 and floating["vs_float"] == []


def test_narrow_words_fail(logs) -> None:
    result = boresight.accuracy("complementary", logs[0], word=18, jobs=1)
    assert not result.good and "attitude beyond its tolerance" in str(result)


def test_an_estimator_that_is_a_dataclass(logs) -> None:
    own = dataclasses.dataclass(type("Own", (Complementary,), {"name": "own"}))()
    assert [*rows(boresight.accuracy([own], logs[0], jobs=1))] == [
        ("own", "fixed"),
        ("own", "float"),
    ]


def test_logs_of_the_same_name(folder, capsys) -> None:
    """The commonest layout of data: a folder for each run, and the same name in each."""
    paths = [str(folder / name / "log.csv") for name in ("log1", "log2")]
    assert main(["accuracy", "complementary", *paths, "--jobs", "1", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [log["trial"] for log in data["logs"]] == ["log1/log", "log2/log"]


def test_a_log_without_truth_is_left_out(folder) -> None:
    result = boresight.accuracy("complementary", folder, jobs=1)
    assert len(result["logs"]) == 2 and "log blind has no truth: left out" in result.notes
    with pytest.raises(InputError, match="wanted a log with the truth .*, found log blind has"):
        boresight.accuracy("complementary", folder / "none")


def test_a_constant_heading_is_taken_out(logs) -> None:
    log, half = NineAxis.of(logs[0]), np.radians(-10.0)
    q = quaternion_multiply([np.cos(half), 0.0, 0.0, np.sin(half)], log.q)
    turned = dataclasses.replace(log, q=q).record()
    plain, off = (
        rows(boresight.accuracy("complementary", x, jobs=1, align=align))[
            ("complementary", "fixed")
        ]
        for x, align in ((logs[0], "none"), (turned, "heading"))
    )
    assert off["mean"]["inclination"] == pytest.approx(plain["mean"]["inclination"])
    assert off["mean"]["heading"] <= plain["mean"]["heading"]
    east, north, up = off["trials"][0]["offset_deg"]
    assert east == north == 0.0 and up == pytest.approx(20.0, abs=3.0)


def test_threads_give_the_same(logs) -> None:
    def made(jobs):
        result = boresight.accuracy("complementary,vqf_online", *logs, jobs=jobs)
        return result["estimators"]

    first = made(1)
    assert made(2) == first


class Rated(Complementary):
    """Is made for the rate of a log."""

    name = "rated"
    rates_hz = {"dt": 50.0}

    def for_rates(self, rates_hz):
        made = Rated()
        made.rates_hz = {"dt": round(rates_hz["dt"])}
        return made


def test_each_rate_has_an_estimator_of_its_own(logs) -> None:
    quick = synthetic_log(seconds=3, rate_hz=100, seed=9, name="quick")
    given = [logs[0], quick, logs[1]]
    got, wanted = (boresight.accuracy(e, *given, jobs=1) for e in (Rated(), "complementary"))
    for row, other in zip(got["estimators"], wanted["estimators"], strict=True):
        assert row["trials"] == other["trials"]
    tuned = boresight.tune(Rated(), *given, names=["kp_roll_per_s"], rounds=1, folds=1, jobs=1)
    errors = [trial["error"] for trial in got["estimators"][0]["trials"]]
    assert [trial["default"] for trial in tuned["trials"]] == errors


class Speed(Estimator):
    """Twice its input, with a truth in its own unit."""

    inputs = (Input("a", -1.0, 1.0, "m/s"),)
    outputs = (Output("v", "m/s", tolerance=1e-6),)

    def step(self, x, u, p):
        return {}, {"v": 2.0 * u.a}


def test_an_estimator_without_attitude() -> None:
    log = {"a": [0.1, 0.2, 0.3], "v_true": [0.2, 0.5, np.nan]}
    result = boresight.accuracy(Speed, log, jobs=1)
    assert result["estimators"][0]["mean"]["v"] == pytest.approx(0.1 / 2**0.5, rel=1e-5)
    assert result["estimators"][0]["units"] == {"v": "m/s"}
    assert "speed v m/s" in str(result).split("error on each log")[1]
    with pytest.raises(InputError, match="wanted attitudes"):
        boresight.accuracy(Speed, log, align="heading")
    with pytest.raises(InputError, match="the bundled ones are of attitudes"):
        boresight.accuracy(Speed)


def test_a_published_filter_that_is_not_installed(monkeypatch, logs) -> None:
    monkeypatch.setitem(sys.modules, "vqf", None)
    with pytest.raises(ToolMissing, match="vqf"):
        boresight.accuracy("vqf_online", logs[0])
    result = boresight.accuracy(FIRST, logs[0], jobs=1)
    assert [n.split(":")[0] for n in result.notes[-2:]] == [
        "vqf_online left out",
        "vqf_basic left out",
    ]
