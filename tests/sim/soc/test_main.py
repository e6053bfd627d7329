"""The command line of the measurements."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from boresight.firmware.soc import image
from boresight.sim.soc.__main__ import main, table

ROW = {
    "estimator": "mekf",
    "paper_cycles": None,
    "hardware": {"cycles": 344},
    "ratios": {"integer_to_hardware": 81.6, "float_to_hardware": 280.3},
    "float": {
        "cycles": {"median": 96425},
        "code_bytes": 22144,
        "status_mismatches": 0,
        "apart_deg": 1e-4,
        "bound_deg": 0.02,
    },
    "integer": {"cycles": {"median": 28071}, "code_bytes": 39628, "mismatches": 0},
}


@pytest.mark.without_compiler
def test_table_says_what_differs() -> None:
    assert table([ROW]).splitlines()[1].split() == [
        "mekf",
        "96425",
        "-",
        "28071",
        "344",
        "82",
        "280",
        "22144",
        "39628",
        "yes",
    ]
    for way, key, value in (
        ("float", "apart_deg", 0.03),
        ("float", "apart_deg", float("nan")),
        ("float", "status_mismatches", 1),
        ("integer", "mismatches", 1),
    ):
        row = {**ROW, way: {**ROW[way], key: value}}
        assert table([row]).endswith(" NO")


def test_one_estimator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--estimator", "complementary", "--updates", "3", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[1].startswith("complementary ")
    (row,) = json.loads((tmp_path / "report.json").read_text())["software"]
    assert row["float"]["updates"] == 3


@pytest.mark.without_compiler
def test_wrong_use(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--updates", "1"]) == 2
    assert capsys.readouterr().err == "error: --updates: wanted 2 or more, found 1; ask for more\n"


@pytest.mark.without_compiler
def test_no_compiler(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(image.shutil, "which", lambda name: None)
    assert main(["--estimator", "mekf", "--updates", "2"]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("error: riscv64-unknown-elf-gcc was not found: run 'make firmware'")
