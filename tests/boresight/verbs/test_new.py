"""`boresight new`: what it writes passes at once, and it writes over nothing."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml  # type: ignore[import-untyped]

import boresight
from boresight.cli import main
from boresight.model.resolve import estimator_of
from boresight.sim.worlds.world import World
from tests.support.pages import ROOT, call_tests, user_folder


@pytest.fixture
def folder(tmp_path, monkeypatch):
    with user_folder(tmp_path, monkeypatch):
        yield tmp_path


def test_all_of_it_passes_at_once(folder, capsys):
    assert main(["new", "my_filter", "--json"]) == 0
    written = ["my_filter.py", "my_filter.csv", "test_my_filter.py", "my_filter_baseline.json"]
    assert capsys.readouterr().out == '{"files": ["' + '", "'.join(written) + '"]}\n'
    assert sorted(p.name for p in folder.iterdir() if p.name[0] != ".") == sorted(written)
    assert estimator_of("my_filter.py").name == "myfilter"
    call_tests(folder)  # float64, integers, C and Verilog of the log, truth, the loop
    assert main(["simulate", "my_filter.py", "my_filter.py", "--steps", "50", "-q"]) == 0


def test_workflows(folder, capsys):
    """Those of the page; what they run is there."""
    assert main(["new", "tracker", "--ci"]) == 0
    assert ".gitlab-ci.yml: runs all of it" in capsys.readouterr().out
    page = (ROOT / "docs" / "learn" / "ci.md").read_text("utf-8")
    texts = [
        (folder / path).read_text("utf-8")
        for path in (".github/workflows/tracker.yml", ".gitlab-ci.yml")
    ]
    assert re.findall(r"```yaml\n(.*?)```", page, re.S) == texts
    (job,) = yaml.safe_load(texts[0])["jobs"].values()
    runs = [step["run"] for step in job["steps"] if "run" in step]
    assert runs == yaml.safe_load(texts[1])["filter"]["script"][1:]
    first = re.findall(r"boresight (.*) > (\S+\.json)\n", texts[0])
    assert all(f"--baseline {path}" in run for run, (_, path) in zip(runs[2:], first, strict=True))
    for line, path in first:  # area takes a minute
        capsys.readouterr()
        assert main(line.replace(" --synth", "").split()) == 0
        Path(path).write_text(capsys.readouterr().out)
    for run in runs[2:]:
        assert main(run.replace(" --synth", "").split()[1:]) == 0, run
    assert {"core.xml", "accuracy.xml"} <= {p.name for p in folder.iterdir()}


def test_lint_and_format(folder):
    boresight.new("kalman_of_mine")
    for command in (["check", "--select", "E,F,I,B,UP,SIM"], ["format", "--check"]):
        ruff = [sys.executable, "-m", "ruff", *command, "--line-length", "100", "--no-cache", "."]
        done = subprocess.run(ruff, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


def test_the_log_is_what_the_world_shows(folder):
    boresight.new("own")
    from boresight.sim.worlds.world import world_of

    world, log = world_of("own.py"), boresight.record_of("own.csv")
    assert isinstance(world, World)
    world.start()
    for k in range(len(log)):
        record = world.record(None)
        for name in ("z", "pos_true", "vel_true"):
            assert log.columns[name].values[k] == pytest.approx(record[name], abs=6e-4, nan_ok=True)
    assert world.record(None) is None
    assert np.isnan(log.columns["z"].values).sum() == len(log) // 10
    world.draw(2)
    world.start()
    assert world.record(None)["z"] != pytest.approx(log.columns["z"].values[0], abs=6e-4)


def test_a_file_of_ones_own_stays(folder, capsys):
    (folder / "test_kept_one.py").write_text("mine\n")
    assert main(["new", "kept_one"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert "test_kept_one.py" in said.err and "NAME" in said.err
    assert [p.name for p in folder.iterdir() if p.name[0] != "."] == ["test_kept_one.py"]
    assert (folder / "test_kept_one.py").read_text() == "mine\n"
    boresight.new("sub/other.py")
    source = folder / "sub" / "other.py"
    source.write_text(source.read_text() + "# changed\n")
    assert main(["new", "sub/other"]) == 2
    assert source.read_text().endswith("# changed\n")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("my-filter", "found 'my-filter'"),
        ("1st", "found '1st'"),
        ("__", "found '__'"),
        ("", "found ''"),
        ("folder/", "found a folder"),
        ("größe", "found 'größe'"),
        ("class", "a word of Python"),
        ("none", "a word of Python"),
        ("mekf", "the name of an estimator that is there"),
        ("numpy", "an installed module"),
        ("boresight.py", "an installed module"),
        ("__main__", "an installed module"),
    ],
)
def test_names_that_no_module_may_have(name, reason, folder, capsys):
    assert main(["new", name]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("error: ") and said.err.count("\n") == 1
    assert reason in said.err and "choose another, such as my_filter" in said.err
    assert not list(folder.iterdir())


def test_nothing_of_the_template_is_left(folder):
    for path in boresight.new("bear").files:
        assert "starter" not in path.read_text().lower()
    assert (ROOT / "boresight" / "starter" / "estimator.txt").read_text().count("Starter") == 2
