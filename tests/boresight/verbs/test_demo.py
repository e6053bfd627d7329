"""`boresight demo`: every filter proven on one core."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

import boresight
from boresight.cli import main
from boresight.gateware.synthesis.routed import Mapped
from boresight.sim.compare.results import LevelResult


def test_demo_proves_every_filter_on_one_core(tmp_path, monkeypatch):
    module = import_module("boresight.verbs.demo")
    # The smaller core is synthesised, once; `make` does both.
    areas: list[Mapped] = []
    synthesis = module.map_core
    monkeypatch.setattr(
        module, "map_core", lambda *core: (areas or areas.append(synthesis(*core)) or areas)[0]
    )
    monkeypatch.setattr(module, "BOARD_S", 0.02)
    data = boresight.demo(("complementary", "complementary_as_printed"), steps=20, output=tmp_path)
    assert data.good is True
    assert [(r.config, r.estimator) for r in data.filters] == [
        (c, e) for c in ("small", "fast") for e in ("complementary", "complementary_as_printed")
    ]
    for row in data.filters:
        assert row.mismatches == 0 and row.updates_proven["verilator"] == 20
        assert Path(row.report).is_file()
    for core in data.cores:
        assert (tmp_path / f"core-{core.config}" / "core.v").is_file()
        report = json.loads((tmp_path / f"core-{core.config}" / "report.json").read_text())
        assert report["resources"]["lut"] == core.lut
        assert list(report["programs"]) == ["complementary", "complementary_as_printed"]
    assert json.loads((tmp_path / "summary.json").read_text()) == data.to_json()
    assert (
        str(data).split("report:")[0].count("complementary_as_printed") == 3
    )  # two cores and the board
    assert [(r.filter, r.good) for r in data.board] == [
        ("complementary", True),
        ("complementary_as_printed", True),
    ]
    assert (tmp_path / "board" / "board.html").is_file()


def test_what_cannot_run_is_told_before_anything_else(tmp_path, monkeypatch, capsys) -> None:
    module = import_module("boresight.verbs.demo")
    line = ["demo", "--steps", "20", "-o", str(tmp_path / "out"), "-q"]
    failed = LevelResult("rtl", "verilator", None, None, 0.0, error="no libpython")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("boresight.sim.rtl.simulators._missing", lambda name: f"no {name}")
        patch.setattr(module, "Build", lambda *args, **options: pytest.fail("has begun"))
        assert main(line) == 1
    assert capsys.readouterr().err == "error: no verilator\n"
    check = SimpleNamespace(run=lambda record: [SimpleNamespace(levels=[failed])] * 4)
    monkeypatch.setattr(module, "Check", lambda build, **options: check)
    monkeypatch.setattr(module, "map_core", lambda *core: pytest.fail("has gone on"))
    assert main(line) == 1
    assert capsys.readouterr().err == "error: rtl in verilator: no libpython\n"
    assert not (tmp_path / "out").exists()
