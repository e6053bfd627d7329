"""`boresight tune`: the search, its folds, and the file that --params reads."""

from __future__ import annotations

import json

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, Output, Param, State
from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.accuracy.tuning import axes_of, folds_of, pattern_search


class Smooth(Estimator):
    """A smoother with a gain, and a bias that is 0 by default."""

    inputs = (Input("z", -8.0, 8.0, "m"),)
    params = (Param("gain", 0.05, 0.0, 1.0), Param("bias", 0.0, -4.0, 4.0, "m"))
    states = (State("m", -8.0, 8.0, "m"),)
    outputs = (Output("pos", "m"),)

    def step(self, x, u, p):
        m = x.m + p.gain * (u.z - p.bias - x.m)
        return {"m": m}, {"pos": m}


def log(seed: int) -> dict[str, np.ndarray]:
    """A walk, in a sensor that is 1 m off and has a noise of 0.3 m."""
    rng = np.random.default_rng(seed)
    walk = np.clip(np.cumsum(rng.normal(0.0, 0.2, 200)), -5.0, 5.0)
    return {"z": walk + 1.0 + rng.normal(0.0, 0.3, 200), "pos_true": walk}


LOGS = [log(seed) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def result():
    return boresight.tune(Smooth, *LOGS, jobs=1)


def test_a_parameter_whose_default_is_zero_is_tuned(result) -> None:
    assert result["parameters"]["bias"] == pytest.approx(1.0, abs=0.1)
    assert 0.3 < result["parameters"]["gain"] < 0.9
    assert result["error"]["tuned"]["pos"] < 0.3 < 1.0 < result["error"]["default"]["pos"]
    assert result["search"]["history"][-1] == pytest.approx(result["error"]["tuned"]["pos"])


def test_folds_are_tuned_without_their_own_logs(result) -> None:
    folds = result["cross_validation"]["folds"]
    assert [fold["test"] for fold in folds] == [["record"], ["record2"], ["record3"]]
    alone = boresight.tune(Smooth, *LOGS[1:], folds=1, jobs=1)
    assert {n: alone["parameters"][n] for n in ("gain", "bias")} == folds[0]["parameters"]
    assert alone["cross_validation"] is None
    other = boresight.accuracy(Smooth, LOGS[0], params={"smooth": folds[0]["parameters"]}, jobs=1)
    assert other["estimators"][0]["mean"]["pos"] == pytest.approx(folds[0]["test_figure"])


SOURCE = """
from boresight import Estimator, Input, Output, Param

class Scale(Estimator):
    inputs = (Input("a", -1.0, 1.0),)
    params = (Param("gain", 1.0, 0.1, 4.0),)
    outputs = (Output("y"),)

    def step(self, x, u, p):
        return {}, {"y": p.gain * u.a}
"""


def test_accuracy_reads_the_file(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scale.py").write_text(SOURCE)
    (tmp_path / "log.csv").write_text("a,y_true\n0.1,0.25\n-0.4,-1.0\n")
    assert main(["tune", "scale.py", "log.csv", "-o", "tuned.json"]) == 0
    tuned = json.loads((tmp_path / "tuned.json").read_text())
    assert tuned["parameters"]["gain"] == pytest.approx(2.5, rel=0.04)
    capsys.readouterr()
    assert main(["accuracy", "scale.py", "log.csv", "--param", "@tuned.json", "--json"]) == 0
    (fixed, _) = json.loads(capsys.readouterr().out)["estimators"]
    assert fixed["mean"]["y"] == pytest.approx(tuned["error"]["tuned"]["y"])


@pytest.mark.parametrize(("factor", "end"), [(3.0, ""), (9.0, "upper"), (0.05, "lower")])
def test_an_end_of_a_range_and_no_cross_validation_are_told(factor, end, tmp_path) -> None:
    (tmp_path / "scale.py").write_text(SOURCE)
    rows = {"a": [0.1, -0.4], "y_true": [0.1 * factor, -0.4 * factor]}
    notes = boresight.tune(f"{tmp_path}/scale.py", rows, jobs=1).notes
    found = [n for n in notes if n.startswith(f"gain ends at the {end} end of its range, 0.1 to 4")]
    assert len(found) == bool(end) and len(notes) == 1 + len(found)
    assert "no cross-validation, since there is one log" in notes[-1]


def test_words_that_saturate_are_told() -> None:
    class Sum(Estimator):
        """A sum of inputs that its range does not hold."""

        inputs = (Input("z", -1.0, 1.0),)
        params = (Param("gain", 1.0, 0.5, 2.0),)
        states = (State("total", -8.0, 8.0),)
        outputs = (Output("sum"),)

        def step(self, x, u, p):
            total = x.total + p.gain * u.z
            return {"total": total}, {"sum": total}

    rows = {"z": np.ones(20), "sum_true": np.arange(1.0, 21.0)}
    result = boresight.tune(Sum, rows, rounds=1, jobs=1)
    assert result["saturated_updates"] == 5 and "SATURATED: state total" in result.notes[0]


def test_what_the_reader_warns_of_is_a_note() -> None:
    class Turned(Estimator):
        """A rate in degrees where radians are declared."""

        inputs = (Input("rate", -100.0, 100.0, "rad/s"),)
        params = (Param("gain", 1.0, 0.5, 2.0),)
        outputs = (Output("turned", tolerance=1e-3),)

        def step(self, x, u, p):
            return {}, {"turned": p.gain * u.rate}

    rows = {"rate": np.full(20, 57.3), "turned_true": np.full(20, 57.3)}
    tuned = boresight.tune(Turned, rows, rounds=1, jobs=1)
    for result in (tuned, boresight.accuracy(Turned, rows)):
        assert any("looks like deg/s" in text for text in result.notes)


@pytest.mark.parametrize(
    ("errors", "told"), [([6.2], 1), ([6.4, -12.5], 2), ([3.1], 0), ([4.0, 6.2], 0)]
)
def test_errors_of_whole_turns_are_told_by_every_verb(errors, told) -> None:
    class Heading(Estimator):
        """An angle in radians."""

        inputs = (Input("a", -4.0, 4.0, "rad"),)
        params = (Param("gain", 1.0, 0.5, 2.0),)
        outputs = (Output("heading", "rad", tolerance=1e-3),)

        def step(self, x, u, p):
            return {}, {"heading": p.gain * u.a}

    a = np.linspace(0.2, 3.0, 20)
    rows = {"a": a, "heading_true": a - np.append(np.zeros(20 - len(errors)), errors)}
    (checked,) = boresight.check(Heading, rows, levels=("c",))["results"]
    others = [verb(Heading, rows) for verb in (boresight.run, boresight.accuracy)]
    others.append(boresight.tune(Heading, rows, rounds=1, jobs=1))
    for notes in (checked.to_json()["warnings"], *(result.notes for result in others)):
        said = [text for text in notes if "modulo a turn" in text]
        assert [f"whole turn in {told} of 20" in text for text in said] == [True] * bool(told)


@pytest.mark.parametrize("start", [(4.0, 0.0), (0.5, -3.0)])
def test_the_search_finds_a_minimum_off_the_axes(start) -> None:
    def figure(values):
        x, y = np.log(values["gain"] / 0.3), values["bias"] - 2.0
        return x * x + y * y + 1.5 * x * y

    axes = axes_of(Smooth(), {"gain": min(start[0], 1.0), "bias": start[1]})
    tuned = pattern_search(figure, axes, rounds=40)
    assert tuned.values == pytest.approx({"gain": 0.3, "bias": 2.0}, abs=0.02)
    assert tuned.history[-1] < 1e-4 and tuned.history == sorted(tuned.history, reverse=True)


class AlphaBeta(Smooth):
    params = (Param("alpha", 0.2, 0.0, 1.0), Param("beta", 2.0, 0.0, 16.0, "1/s"))


@pytest.mark.parametrize("start", [(0.5, 0.02), (0.01, 0.01), (1.0, 0.0), (0.0, 0.0)])
def test_a_local_minimum_is_left(start) -> None:
    """Position and velocity from positions, without the velocity, are a minimum of their own."""
    truth = 4.0 * np.sin(0.3 * 0.02 * np.arange(1500))
    z = truth + 0.5 * np.random.default_rng(3).standard_normal(1500)

    def error(alpha, beta):
        pos = vel = total = 0.0 * alpha
        for measured, true in zip(z.tolist(), truth.tolist(), strict=True):
            innovation = measured - pos - 0.02 * vel
            pos, vel = pos + 0.02 * vel + alpha * innovation, vel + beta * (0.02 * innovation)
            total = total + (pos - true) ** 2
        return (total / 1500) ** 0.5

    grid = error(*np.meshgrid(np.geomspace(1e-3, 1.0, 40), np.geomspace(1e-3, 16.0, 40)))
    axes = axes_of(AlphaBeta(), dict(zip(("alpha", "beta"), start, strict=True)))
    tuned = pattern_search(lambda v: error(v["alpha"], v["beta"]), axes, rounds=12)
    assert tuned.history[-1] < 1.01 * grid.min()


def test_folds_hold_every_log_once() -> None:
    assert folds_of(5, None) == [(0, 3), (1, 4), (2,)]
    assert folds_of(1, None) == folds_of(4, 1) == []
    with pytest.raises(InputError, match="to 2, the number of logs"):
        folds_of(2, 3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"names": ["gian"]}, "wanted one of gain, bias"),
        ({"names": ["gain", "gain"]}, "wanted each once"),
        ({"weights": {"x": 1.0}}, "weight x"),
        ({"weights": {"pos": 0.0}}, "wanted one above 0"),
    ],
)
def test_bad_options(options, message) -> None:
    with pytest.raises(InputError, match=message):
        boresight.tune(Smooth, *LOGS, **options)
