"""`boresight convert`: a data set's files become logs that the other verbs read."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from scipy.io import savemat

from boresight.cli import main
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from tests.support.broad import trial


def test_a_folder_becomes_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("02_b", "01_a"):
        savemat(tmp_path / f"{name}.mat", trial())
    out = tmp_path / "logs"
    assert main(["convert", "broad", str(tmp_path), "-o", str(out), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["samples"] for row in data["logs"]] == [40, 40]
    assert [row["log"] for row in data["logs"]] == [str(out / f"0{k}.npz") for k in ("1_a", "2_b")]
    for row in data["logs"]:
        assert NineAxis.of(read_record(row["log"])).counts.sum() == 29


def test_one_bad_file_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    savemat(tmp_path / "01_a.mat", trial())
    (tmp_path / "02_b.mat").write_bytes(b"no trial")
    assert main(["convert", "broad", str(tmp_path), "-o", str(tmp_path / "logs")]) == 2
    assert "02_b.mat" in capsys.readouterr().err
    assert not list(tmp_path.glob("logs/*.npz"))
