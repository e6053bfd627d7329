"""Dask: the line that says what to install, and the same figures from two workers."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import boresight
from boresight.cli import main
from boresight.model.errors import ToolMissing
from boresight.sim.montecarlo.cluster import cluster

DRIFT = Path(__file__).parents[2] / "support" / "drift.py"
TEXTS = (f"{DRIFT}:Constant", f"{DRIFT}:Mean")


def test_without_dask_one_line_says_what_to_install(monkeypatch, tmp_path, capsys) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ToolMissing, match="pip install 'boresight"), cluster("tcp://here:8786"):
        pass
    arguments = ["montecarlo", *TEXTS, "--scheduler", "tcp://here:8786", "-o", str(tmp_path)]
    assert main(arguments) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_objects_cannot_go_to_a_cluster(tmp_path) -> None:
    from tests.support.drift import Constant, Mean

    with pytest.raises(boresight.InputError, match="^scheduler: wanted world and estimator by"):
        boresight.montecarlo(Constant, Mean, scheduler="tcp://here:8786", output=tmp_path)


@pytest.mark.filterwarnings("ignore")
def test_two_workers_give_what_one_process_gives(tmp_path) -> None:
    distributed = pytest.importorskip("distributed")
    names = [tmp_path / "one", tmp_path / "two"]
    boresight.montecarlo(*TEXTS, runs=12, jobs=1, output=names[0])
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as here:
        boresight.montecarlo(*TEXTS, runs=12, scheduler=here.scheduler_address, output=names[1])
    one, two = ((n / "montecarlo-constant-mean.json").read_text() for n in names)
    assert one == two
