"""`boresight montecarlo`: right figures, however the draws are dealt out and however often cut."""

from __future__ import annotations

import json
import shlex
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.sim.montecarlo.campaign import draws
from tests.support.drift import Constant, Mean

DRIFT = Path(__file__).parents[3] / "support" / "drift.py"
TEXTS = (f"{DRIFT}:Constant", f"{DRIFT}:Mean")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder and result of forty draws in this process."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, boresight.montecarlo(*TEXTS, runs=40, jobs=1, output=folder)


def test_the_right_filter_is_found_right(whole) -> None:
    folder, data = whole
    spread = data.outputs["mean"]
    assert abs(spread.mean[-1]) < 1.5 * spread.mean_band[-1]
    assert spread.ratio[-1] == pytest.approx(1.0, abs=0.3)
    for value, mean in ((data.nees, data.nees.mean[-1]), (data.nis, data.nis.mean)):
        low, high = value.band
        assert low < mean < high, value
    stored = json.loads((folder / "montecarlo-constant-mean.json").read_text())
    assert stored == {k: v for k, v in data.to_json().items() if k != "file"}
    assert data.marks[-1] == 59 and data.saturated == 0


@pytest.mark.parametrize(
    ("members", "found"),
    [
        ({"nis_freedom": "two"}, "found 'two', outputs mean, nis; write for example"),
        ({"nis_freedom": -2}, "found -2, outputs mean, nis"),
        ({"outputs": Mean.outputs[:1]}, "found 1, outputs mean; .* among the outputs"),
    ],
)
def test_what_nis_cannot_be_computed_of(members, found, tmp_path) -> None:
    """It is refused before any draw."""
    of = type("Mean", (Mean,), members)
    with pytest.raises(boresight.InputError, match=f"nis_freedom: wanted .*{found}"):
        boresight.montecarlo(Constant, of, runs=2, output=tmp_path)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ((("mean",), 3.0), r"the shape \(\) of 1 names"),
        ((("mean",), np.ones((50, 2, 2))), r"the shape \(50, 2, 2\) of 1 names"),
        ((("meen",), np.ones((50, 1, 1))), "the name 'meen'"),
        ((("mean",), "one"), "a str that holds no numbers"),
        ((("mean",), np.ones((50, 1, 1)), 1), "3 values"),
        ((("mean", "mean"), np.ones((50, 2, 2))), "a singular one; leave out what follows"),
    ],
)
def test_covariances_that_are_none(given, found, tmp_path) -> None:
    of = type("Mean", (Mean,), {"error_covariance": lambda self, states, params: given})
    where = "estimator mean, error_covariance, seed 1: wanted .* found"
    with pytest.raises(boresight.InputError, match=f"{where} {found}"):
        boresight.montecarlo(Constant, of, runs=2, output=tmp_path)


class Late(Constant):
    """The truth of the last records is missing."""

    def record(self, outputs):
        made = super().record(outputs)
        return made and {**made, "mean_true": made["mean_true"] if self.k < 50 else np.nan}


class Negative(Mean):
    def error_covariance(self, states, params):
        return ("mean",), -states["p"][:, None, None]


@pytest.mark.parametrize(("world", "of"), [(Late, Mean), (Constant, Negative)])
def test_nees_that_is_no_number_is_said_to_be_none(world, of, tmp_path) -> None:
    said = str(boresight.montecarlo(world, of, runs=2, jobs=1, output=tmp_path))
    assert "NEES, in record 59 of each draw: no number, since an error is none or " in said
    assert (said.splitlines()[1].split()[1] == "-") == (world is Late)


def test_the_worst_draw_is_named_and_runs_alone(whole, tmp_path, capsys) -> None:
    worst, world, errors = whole[1].worst, Constant(), {}
    for seed in range(1, 41):
        world.draw(seed)
        errors[seed] = abs(sum(world.value + world.noise) / 60.25 - world.value)
    assert worst.seed == max(errors, key=lambda seed: errors[seed])
    assert worst.error == pytest.approx(errors[worst.seed], abs=1e-5)
    assert f"worst draw: seed {worst.seed}, mean off by" in str(whole[1])
    log = tmp_path / "loop.csv"
    assert main([*shlex.split(worst.command)[1:], "-o", str(log)]) == 0
    world.draw(worst.seed)
    assert boresight.record_of(log).values("mean_true", "")[-1] == world.value


def test_it_does_not_matter_who_runs_them(whole, tmp_path) -> None:
    text = (whole[0] / "montecarlo-constant-mean.json").read_text()
    with ThreadPoolExecutor(1) as pool:
        boresight.montecarlo(*TEXTS, runs=40, executor=pool, output=tmp_path)
    assert (tmp_path / "montecarlo-constant-mean.json").read_text() == text


def test_two_processes(whole, tmp_path) -> None:
    boresight.montecarlo(*TEXTS, runs=40, jobs=2, output=tmp_path)
    text = (whole[0] / "montecarlo-constant-mean.json").read_text()
    assert (tmp_path / "montecarlo-constant-mean.json").read_text() == text


def test_nothing_is_lost_of_one_that_is_cut(whole, tmp_path, monkeypatch) -> None:
    done = []

    def cut(campaign, seeds, inner=draws):
        done.extend(seeds)
        if len(done) == 18:
            raise KeyboardInterrupt
        return inner(campaign, seeds)

    monkeypatch.setattr("boresight.verbs.figures.montecarlo.draws", cut)
    with pytest.raises(KeyboardInterrupt):
        boresight.montecarlo(*TEXTS, runs=40, jobs=1, output=tmp_path)
    journal = tmp_path / "montecarlo-constant-mean.runs"
    with closing(sqlite3.connect(journal)) as base:
        assert base.execute("SELECT count(*) FROM runs").fetchone() == (17,)
    said: list[str] = []
    boresight.montecarlo(*TEXTS, runs=40, jobs=1, output=tmp_path, progress=said.append)
    assert said[0] == "17 of 40 runs are done already" and said[-1] == "40 of 40 runs"
    assert done == [*range(1, 19), *range(18, 41)]
    text = (whole[0] / "montecarlo-constant-mean.json").read_text()
    assert (tmp_path / "montecarlo-constant-mean.json").read_text() == text


def test_a_journal_of_another_campaign_is_not_touched(whole, capsys) -> None:
    folder, _ = whole
    journal = folder / "montecarlo-constant-mean.runs"
    before = journal.read_bytes()
    arguments = ["montecarlo", *TEXTS, "--runs", "3", "--param", "p0=2", "-o", str(folder)]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert "wanted the journal of this campaign, found that of another one" in error
    assert error.count("\n") == 1 and journal.read_bytes() == before


def test_objects_run_here(tmp_path) -> None:
    data = boresight.montecarlo(Constant(20), Mean, runs=3, seed=5, on="float", output=tmp_path)
    assert (data.runs, data.seed, data.level) == (3, 5, "float")
    assert data.nees is None and "nees" not in data.to_json()  # float keeps no words of states


WORLDS = """\
from boresight import World


class Still(World):
    def record(self, outputs):
        return {'z': 0.0} if outputs is None else None


class Silent(Still):
    def draw(self, seed):
        pass


class Same(Silent):
    def record(self, outputs):
        return {'z': 0.0, 'mean_true': 0.0} if outputs is None else None


class Drawless(Same):
    def draw(self, seed):
        missing


class Unasked(Same):
    def draw(self):
        pass


class Varied(Same):
    def draw(self, seed):
        self.seed = seed

    def record(self, outputs):
        return {'z': 0.0, 'mean_true': self.seed} if outputs is None else None


class Unbounded(Varied):
    def bound(self):
        return {'mean': 1 / 0}


class Unnamed(Varied):
    def bound(self):
        return None


class Short(Varied):
    def bound(self):
        return {'mean': []}


class Second(Varied):
    def record(self, outputs):
        return super().record(outputs) if self.seed < 2 else 1 / 0
"""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Still", "wanted a world with draws"),
        ("Silent", "wanted the truth"),
        ("Same", "world same, draw: wanted another run for each seed, found 2 equal runs; let"),
        ("Drawless", "draw, w.py, line 21: wanted a draw of seed 1, found NameError"),
        ("Unasked", "positional argument but 2 were given; write draw(self, seed)"),
        ("Unbounded", "bound, w.py, line 39: wanted standard deviations of 1 records by output"),
        ("Unnamed", "output name, found NoneType; return"),
        ("Short", "found the shape (0,) of mean; return"),
        ("Second", "line 54, seed 2: wanted a record: values by input name"),
    ],
)
def test_worlds_that_cannot_be_drawn(name: str, message: str, tmp_path, capsys) -> None:
    path = tmp_path / "w.py"
    path.write_text(WORLDS)
    arguments = ["montecarlo", f"{path}:{name}", TEXTS[1], "--jobs", "1", "--runs", "2"]
    assert main([*arguments, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert message in error
    assert not [*tmp_path.glob("out/*.json")]


def test_text_of_people(tmp_path, capsys) -> None:
    assert main(["montecarlo", *TEXTS, "--runs", "3", "--jobs", "1", "-o", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert "NEES per degree of freedom" in out and "3 draws" in out and "3 of 3 runs" in err


@pytest.mark.parametrize(
    ("what", "old", "new"),
    [
        ("filter", "0.01, 16.0", "0.02, 16.0"),
        ("world", "2.0 * rng", "1.0 * rng"),
        ("helper", "SIZE = 1", "SIZE = 2"),
    ],
)
def test_a_journal_of_what_has_changed_since_is_refused(what, old, new, tmp_path, capsys) -> None:
    """Draws of the filter or world as it was and as it is would be those of neither."""
    drift = DRIFT.read_text()
    texts = {"filter": drift, "world": f"{drift}\n\nimport helper", "helper": "SIZE = 1\n"}
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text)
    words = ["montecarlo", f"{tmp_path}/world.py:Constant", f"{tmp_path}/filter.py:Mean"]
    words += ["--runs", "2", "--jobs", "1", "-o", str(tmp_path)]
    assert main(words) == 0
    journal = tmp_path / "montecarlo-constant-mean.runs"
    before = journal.read_bytes()
    (tmp_path / f"{what}.py").write_text(texts[what].replace(old, new))
    assert main(words) == 2
    assert "found that of another one" in capsys.readouterr().err
    assert journal.read_bytes() == before
