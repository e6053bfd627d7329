"""Draws of a world: their figures, an interrupted campaign, processes, a cluster."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2 as exact

import boresight
from boresight import Estimator, Input, Output, State, World
from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.montecarlo.campaign import Campaign, chi2, draws, figures, result_of
from tests.support.drift import Constant, Mean

DRIFT = Path(__file__).parents[2] / "support" / "drift.py"
TEXTS = (f"{DRIFT}:Constant", f"{DRIFT}:Mean")
MARKS = np.array([0, 9])


def gaussian(n: int, *, sd: float = 2.0, mean: float = 0.0, believed: float = 2.0):
    """Draws of a Gaussian error of one output at two marks, and what the filter believes."""
    rng = np.random.default_rng(1)
    out = []
    for k in range(n):
        e = mean + sd * rng.normal(size=2)
        out.append(
            {
                "seed": k,
                "records": 10,
                "errors": {"a": e.tolist()},
                "last": {"a": e[1]},
                "nees": ((e / believed) ** 2).tolist(),
                "freedom": 1,
                "nis": [float((rng.normal(size=(20, 3)) ** 2).sum()), 20],
                "saturated": 1,
                "saturations": {"y": 1},
            }
        )
    return out


@pytest.mark.parametrize("freedom", [10, 99, 1500])
def test_quantiles(freedom: int) -> None:
    for p, z in ((0.025, -1.959964), (0.5, 0.0), (0.975, 1.959964)):
        assert chi2(freedom, z) == pytest.approx(exact.ppf(p, freedom), rel=1e-2)


def test_a_consistent_filter_lies_in_its_bands() -> None:
    result = figures(gaussian(400), MARKS, {"a": np.full(10, 2.0)}, 3)
    spread = result["outputs"]["a"]
    assert abs(spread["mean"][1]) < spread["mean_band"][1] < 0.25
    assert spread["sd_band"][0][1] < 2.0 < spread["sd_band"][1][1]
    assert spread["ratio"][1] == pytest.approx(1.0, abs=0.08)
    low, high = result["nees"]["band"][:, 1]
    assert low < result["nees"]["mean"][1] < high
    low, high = result["nis"]["band"]
    assert low < result["nis"]["mean"] < high


@pytest.mark.parametrize(
    ("believed", "verdict"), [(1.8, "too sure"), (2.0, "consistent"), (2.2, "too cautious")]
)
def test_the_verdict(believed: float, verdict: str) -> None:
    data = figures(gaussian(400, believed=believed), MARKS, {}, 0)
    assert verdict in str(result_of({"runs": 400, **data}, ()))


def test_a_bias_lies_outside_its_band() -> None:
    off = figures(gaussian(400, mean=0.5), MARKS, {}, 0)["outputs"]["a"]
    assert off["mean"][1] > off["mean_band"][1] and "bound" not in off


def test_a_draw_by_hand() -> None:
    world = Constant(70)
    campaign = Campaign((world, Mean), length=70)
    (result,) = draws(campaign, [7])
    world.draw(7)
    p, m, nis, errors, nees = 4.0, 0.0, 0.0, [], []
    for z in world.value + world.noise:
        nis += (z - m) ** 2 / (p + 1.0)
        m, p = m + p / (p + 1.0) * (z - m), p / (p + 1.0)
        errors.append(m - world.value)
        nees.append(errors[-1] ** 2 / p)
    marks = campaign.marks(70)
    assert (result["seed"], result["records"], marks[0], marks[-1]) == (7, 70, 0, 69)
    assert result["errors"]["mean"] == pytest.approx(np.array(errors)[marks], abs=1e-6)
    assert result["last"]["mean"] == pytest.approx(errors[-1], abs=1e-6)
    assert result["nees"] == pytest.approx(np.array(nees)[marks], rel=1e-4)
    assert result["nis"] == [pytest.approx(nis, rel=1e-4), 70]


class Straddle(Constant):
    """Draws that end at different records."""

    def draw(self, seed: int) -> None:
        self.records = 47 + 3 * (seed % 5)
        super().draw(seed)


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_draws_of_different_lengths(seed: int, tmp_path) -> None:
    """A figure compares the same record of the draws that reach it."""
    data = boresight.montecarlo(Straddle, Mean, runs=10, seed=seed, jobs=1, output=tmp_path)
    marks = list(data["marks"])
    common = marks[data["common"]]
    assert common <= 46 < marks[-1] <= 58 and data["draws"][-1] < 10
    world, errors = Straddle(), []
    for k in range(seed, seed + 10):
        world.draw(k)
        z = world.value + world.noise[: common + 1]
        errors.append(z.sum() / (len(z) + 0.25) - world.value)
    spread = data["outputs"]["mean"]
    assert spread["sd"][data["common"]] == pytest.approx(np.std(errors, ddof=1), rel=1e-3)
    assert spread["bound"][data["common"]] == pytest.approx((0.25 + common + 1.0) ** -0.5)


@pytest.mark.parametrize("known", [range(50), ()])
def test_records_without_a_true_value(known: Any, tmp_path) -> None:
    class Gaps(Constant):
        def record(self, outputs: Any) -> Any:
            made = super().record(outputs)
            return made and made | ({} if self.k in known else {"mean_true": math.nan})

    judged = type("Mean", (Mean,), {"outputs": (Output("mean", truth=9.0), Output("nis"))})
    result = boresight.montecarlo(Gaps, judged, runs=10, jobs=1, output=tmp_path)
    assert result.good and ("rms_all" in result["outputs"]["mean"]) == bool(known)
    if known:
        world, last = Gaps(), []
        for seed in range(1, 11):
            world.draw(seed)
            last.append(abs(sum(world.value + world.noise[:49]) / 49.25 - world.value))
        assert result["worst"]["error"] == pytest.approx(max(last), abs=1e-5)
        for figure in (result["outputs"]["mean"], result["nees"]):
            assert math.isfinite(figure["mean"][result["common"]])
        assert result["marks"][result["common"]] == 48 and not result.notes
    else:
        (checked,) = boresight.check(judged, Gaps, levels=("c",))["results"]
        assert result.notes[0] in checked.to_json()["warnings"] and " off by " not in str(result)


class Turned(World):
    def draw(self, seed: int) -> None:
        self.start()

    def start(self) -> None:
        self.k = 0

    def record(self, outputs: Any) -> Any:
        self.k += 1
        return None if self.k > 3 else {"a": 0.99, "b_true": -0.99}


class Through(Estimator):
    inputs = (Input("a", -1.0, 1.0, "ht"),)
    outputs = (Output("b", "ht"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"b": u.a}


def test_angles_wrap() -> None:
    (result,) = draws(Campaign((Turned(), Through), length=3), [1])
    assert result["errors"]["b"] == pytest.approx(3 * [-0.02], abs=1e-6)
    assert result["nees"] == [] and result["nis"] == [0.0, 0]


class Seldom(Through):
    """With a measurement, and so a squared innovation, in every second update."""

    nis_freedom = 1
    states = (State("measured", 0.0, 1.0),)
    outputs = (*Through.outputs, Output("nis"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"measured": 1.0 - x.measured}, {"b": u.a, "nis": 4.0 - 4.0 * x.measured}


def test_an_update_without_measurement_has_no_innovation() -> None:
    (result,) = draws(Campaign((Turned(), Seldom), length=3), [1])
    assert result["nis"] == [8.0, 2]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder and result of forty draws in this process."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, boresight.montecarlo(*TEXTS, runs=40, jobs=1, output=folder)


def text_of(folder: Path) -> str:
    return (folder / "montecarlo-constant-mean.json").read_text()


def test_the_worst_draw_is_named_and_runs_alone(whole, tmp_path) -> None:
    worst, world, errors = whole[1]["worst"], Constant(), {}
    for seed in range(1, 41):
        world.draw(seed)
        errors[seed] = abs(sum(world.value + world.noise) / 60.25 - world.value)
    assert worst["seed"] == max(errors, key=lambda seed: errors[seed])
    assert worst["error"] == pytest.approx(errors[worst["seed"]], abs=1e-5)
    log = tmp_path / "loop.csv"
    assert main([*shlex.split(worst["command"])[1:], "-o", str(log)]) == 0
    world.draw(worst["seed"])
    assert boresight.record_of(log).values("mean_true", "")[-1] == world.value


def test_an_interrupted_campaign_continues(whole, tmp_path, monkeypatch) -> None:
    done = []

    def cut(campaign, seeds, inner=draws):
        done.extend(seeds)
        if len(done) == 18:
            raise KeyboardInterrupt
        return inner(campaign, seeds)

    monkeypatch.setattr("boresight.verbs.montecarlo.draws", cut)
    with pytest.raises(KeyboardInterrupt):
        boresight.montecarlo(*TEXTS, runs=40, jobs=1, output=tmp_path)
    boresight.montecarlo(*TEXTS, runs=40, jobs=1, output=tmp_path)
    assert done == [*range(1, 19), *range(18, 41)] and text_of(tmp_path) == text_of(whole[0])
    boresight.montecarlo(*TEXTS, runs=2, jobs=1, again=True, output=tmp_path)
    assert done[-2:] == [1, 2]


@pytest.mark.parametrize(("what", "old", "new"), [("filter", "0.01", "0.02"), ("helper", "1", "2")])
def test_a_changed_file_runs_again(what, old, new, tmp_path, monkeypatch) -> None:
    texts = {"filter": DRIFT.read_text() + "\n\nimport helper", "helper": "SIZE = 1\n"}
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text)
    words = ["montecarlo", TEXTS[0], f"{tmp_path}/filter.py:Mean", "--runs", "2", "--jobs", "1"]
    journal = tmp_path / "montecarlo-constant-mean.jsonl"
    for count in (2, 2):
        assert main([*words, "-o", str(tmp_path)]) == 0
        assert len(journal.read_text().splitlines()) == count
    (tmp_path / f"{what}.py").write_text(texts[what].replace(old, new))
    assert main([*words, "-o", str(tmp_path)]) == 0
    assert len(journal.read_text().splitlines()) == 4


def test_two_processes(whole, tmp_path) -> None:
    boresight.montecarlo(*TEXTS, runs=40, jobs=2, output=tmp_path)
    assert text_of(tmp_path) == text_of(whole[0])
    assert json.loads(text_of(tmp_path)) == whole[1].to_json()


def test_objects_cannot_go_to_a_cluster(tmp_path) -> None:
    with pytest.raises(InputError, match="^scheduler: wanted names or files"):
        boresight.montecarlo(Constant, Mean, scheduler="tcp://here:8786", output=tmp_path)


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"nis_freedom": -1}, "nis_freedom: wanted"),
        ({"outputs": Mean.outputs[:1]}, "nis_freedom: wanted"),
        ({"error_covariance": lambda *_: (("mean",), np.ones((50, 2, 2)))}, "seed 1: .* the shape"),
        ({"error_covariance": lambda *_: (("meen",), 1.0)}, "seed 1: .* the name 'meen'"),
        (
            {"error_covariance": lambda *_: (("mean", "mean"), np.ones((50, 2, 2)))},
            "seed 1: .* a singular one",
        ),
    ],
)
def test_a_filter_without_consistency(members, message, tmp_path) -> None:
    of = type("Mean", (Mean,), members)
    with pytest.raises(InputError, match=message):
        boresight.montecarlo(Constant, of, runs=2, output=tmp_path)


class Silent(Constant):
    def record(self, outputs):
        made = super().record(outputs)
        return made and {"z": made["z"]}


class Same(Constant):
    def draw(self, seed: int) -> None:
        super().draw(0)


class Short(Constant):
    def bound(self):
        return {"mean": []}


class Second(Constant):
    def record(self, outputs):
        return super().record(outputs) if self.seed < 2 else 1 / 0

    def draw(self, seed: int) -> None:
        super().draw(seed)
        self.seed = seed


@pytest.mark.parametrize(
    ("world", "message"),
    [
        (Silent, "wanted the truth"),
        (Same, "draw: wanted another run for each seed, found 2 equal runs"),
        (Short, r"found the shape \(0,\) of mean"),
        (Second, "seed 2: wanted a record"),
    ],
)
def test_a_world_that_cannot_be_drawn(world, message, tmp_path) -> None:
    with pytest.raises(InputError, match=message):
        boresight.montecarlo(world, Mean, runs=2, output=tmp_path)
    assert not [*tmp_path.glob("*.json")]
