"""The complete board in simulation: figures, page, faults, and what it refuses."""

import json
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

import boresight
from boresight import Estimator, Output, Param
from boresight.sim.attitude import system as module
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


@pytest.mark.parametrize(("rate_hz", "notes"), [(50.0, 1), (1024.0, 0)])
def test_another_rate_than_the_boards_is_a_warning(rate_hz, notes, monkeypatch, tmp_path) -> None:
    """A filter of fixed gains, and the notes of its run."""

    class Fixed(Estimator):
        rates_hz = {"dt": rate_hz}
        params = (Param("k", 1.0, 0.0, 2.0),)
        outputs = (Output("y"),)

    seen, compiled = [], []
    monkeypatch.setattr(module, "system_core", lambda *given, **more: compiled.append(more))
    monkeypatch.setattr(module, "write_board", lambda *given, notes, **more: seen.extend(notes))
    boresight.run(Fixed, "board", params={"k": 0.5}, output=tmp_path)
    assert compiled[0]["params"] == {"fixed": {"k": 0.5}}
    assert len(seen) == notes
    assert all("says 50 samples a second, and the board updates it 1024 times" in n for n in seen)


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


def test_faults_run_side_by_side(monkeypatch) -> None:
    """The second ends first: the row of each is told as it ends, the result keeps the order."""
    later, board, said = Event(), SimpleNamespace(verilog="module"), []

    def trial(of, fault, log):
        assert of is board
        if fault == "adis.absent":
            assert later.wait(10.0)
        return {"fault": fault, "good": fault != "hmr.silence"}

    def say(text):
        said.append(text)
        later.set()

    names = ["adis.absent", "hmr.silence"]
    monkeypatch.setattr(module, "fault_board", lambda filter: board)
    monkeypatch.setattr(module, "fault_trial", trial)
    monkeypatch.setattr(module, "FAULTS", names)
    result = AttitudeBoard().simulate_faults(None, progress=say)
    assert [t["fault"] for t in result["trials"]] == names and not result.good
    assert said == ["hmr.silence: FAILED", "adis.absent: good"]
