"""`boresight new`: what it writes passes at once, and it overwrites nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.sim.worlds.world import world_of
from tests.support.pages import call_tests


def test_all_of_it_passes_at_once(here: Path, data) -> None:
    written = ["own.py", "own.csv", "test_own.py", "own_baseline.json"]
    assert data("new own")["files"] == written
    call_tests(here)  # float64, integers, C and Verilog of the log, truth
    for command in (["check", "--select", "E,F,I,B,UP,SIM"], ["format", "--check"]):
        ruff = [sys.executable, "-m", "ruff", *command, "--line-length", "100", "--no-cache", "."]
        done = subprocess.run(ruff, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout
    assert not [name for name in written if "starter" in Path(name).read_text().lower()]


def test_the_log_is_what_the_world_shows(here: Path) -> None:
    world, log = world_of("mine.py"), boresight.record_of("mine.csv")
    world.start()
    for k in range(len(log)):
        record = world.record(None)
        for name in ("z", "pos_true", "vel_true"):
            assert log.columns[name].values[k] == pytest.approx(record[name], abs=6e-4, nan_ok=True)
    assert world.record(None) is None
    assert np.isnan(log.columns["z"].values).sum() == len(log) // 10


def test_the_test_needs_neither_a_world_nor_truth(here: Path) -> None:
    source, log = Path("mine.py"), Path("mine.csv")
    source.write_text(source.read_text().partition("class MineWorld")[0])
    log.write_text("".join(f"{row.rsplit(',', 2)[0]}\n" for row in log.read_text().splitlines()))
    call_tests(here)
    source.write_text(source.read_text().replace("x.pos + u.dt", "x.pos + 1.001 * u.dt"))
    with pytest.raises(AssertionError, match="worse than .*: latency"):
        call_tests(here)


def test_a_file_of_ones_own_stays(here: Path, refused, said) -> None:
    Path("test_kept_one.py").write_text("mine\n")
    assert "test_kept_one.py" in refused("new kept_one") and not Path("kept_one.py").exists()
    said("new kept_one --force")
    assert "mine" not in Path("test_kept_one.py").read_text()


NAMES = {
    "my-filter": "found 'my-filter'",
    "folder/": "found a folder",
    "class": "a word of Python",
    "mekf": "the name of an estimator that is there",
    "numpy": "an installed module",
}


@pytest.mark.parametrize("name", NAMES)
def test_names_that_no_module_may_have(name: str, here: Path, refused) -> None:
    assert NAMES[name] in refused(f"new {name}")
