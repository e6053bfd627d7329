"""The complete board in simulation: figures, page, faults, and what it refuses."""

import json
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

import boresight
from boresight.sim.attitude import system as module
from boresight.sim.attitude.board.faults import FaultTrial
from boresight.sim.attitude.system import AttitudeBoard


@pytest.fixture
def small(monkeypatch) -> None:
    monkeypatch.setattr(module, "FILTERS", ("complementary", "ma2014_cf"))


def test_figures_and_page(small, tmp_path) -> None:
    data = boresight.run("complementary", "board(seconds=0.05)", output=tmp_path)
    assert data.good
    assert json.loads(json.dumps(data.to_json())) == json.loads(
        (tmp_path / "board.json").read_text()
    )
    row = data["runs"][0]
    assert row["updates"] == row["frames"] == 51
    assert row["mismatches"] == row["lost_samples"] == row["timing_violations"] == 0
    assert row["beside_program_us"] <= 1.0
    assert row["in_registers_us"] == row["predicted_us"]
    page = (tmp_path / "board.html").read_text()
    assert "complementary" in page and "http" not in page
    assert "51" in str(data)


def test_data_in_memory_is_read() -> None:
    columns = {"t": np.arange(9.0), "gx": np.zeros(9)}
    with pytest.raises(boresight.InputError, match=r"^log 'record': wanted 51 rows or more, found"):
        AttitudeBoard().simulate(
            Path("build"),
            "mekf",
            columns,
            config="small",
            params={},
            seconds=0.05,
            source="heading",
            feed=None,
            say=print,
        )


def test_unknown_fault_is_refused() -> None:
    with pytest.raises(boresight.InputError, match="found 'adis.gremlins'"):
        AttitudeBoard().simulate_faults("mekf", faults=["adis.gremlins"], jobs=None, progress=None)


def test_faults_run_side_by_side(monkeypatch) -> None:
    """The second ends first: the row of each is told as it ends, the result keeps the order."""
    later, board, said = Event(), SimpleNamespace(verilog="module"), []

    def trial(of, device, fault, log):
        assert of is board
        if fault == "absent":
            assert later.wait(10.0)
        return FaultTrial(device, fault, 0.2, 0.0, ("inertial_lost",), 0, 1.0, 1.0, 0.5, 0.01)

    def say(text):
        said.append(text)
        later.set()

    monkeypatch.setattr(module, "fault_board", lambda filters: board)
    monkeypatch.setattr(module, "fault_trial", trial)
    names = ["adis.absent", "hmr.silence"]
    result = AttitudeBoard().simulate_faults(None, faults=names, jobs=2, progress=say)
    assert [f"{t['device']}.{t['fault']}" for t in result["trials"]] == names
    assert [text.split()[1] for text in said] == ["silence", "absent"]
    assert said[1] in str(result)
    with pytest.raises(boresight.InputError, match="jobs: wanted"):
        AttitudeBoard().simulate_faults(None, faults=None, jobs=0, progress=None)
