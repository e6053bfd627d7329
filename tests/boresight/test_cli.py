"""The command line: exit codes, one-line errors, nothing half-written, JSON alone on stdout."""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path

import pytest
from boresight.sim.compare.check_shared import shared_core

import boresight
from boresight.cli import main
from boresight.core_files import core_files, project_files
from boresight.model.estimators import estimator
from boresight.sim.records.bundled import bundled
from boresight.verbs.demo import summary_table

HEADER = "t,gx,gy,gz,ax,ay,az,mx,my,mz\n"
ROW = "{t},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40\n"
GOOD = HEADER + "".join(ROW.format(t=k / 100) for k in range(20))


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(GOOD)
    return path


def refused(capsys, *argv):
    """Run; expect exit code 2 and one line on stderr, nothing on stdout."""
    try:
        code = main([str(a) for a in argv])
    except SystemExit as stop:
        code = stop.code
    out = capsys.readouterr()
    assert code == 2, out
    assert out.out == ""
    assert out.err.count("\n") == 1 and out.err.startswith("error: "), out.err
    return out.err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD.replace("gz", "gq"), "a column gz [rad/s]"),
        (GOOD.replace(",mz\n", "\n").replace(",-40\n", "\n"), "a column mz [uT]"),
        (HEADER + ROW.format(t="zero"), "zero"),
        (HEADER + ROW.format(t=0).replace("9.8", "nan"), "nan"),
        (HEADER + ROW.format(t=1) + ROW.format(t=0), "increas"),
        (HEADER, "row"),
        ("", "empty"),
    ],
)
def test_bad_logs(tmp_path, capsys, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    error = refused(capsys, "run", "complementary", path, "-o", tmp_path / "out.csv")
    assert message in error and "bad.csv" in error
    assert not (tmp_path / "out.csv").exists()


def test_bad_names_and_widths(log, capsys, tmp_path):
    assert "complementary" in refused(capsys, "run", "kalman", log)
    assert "mimas" in refused(
        capsys, "compile", "complementary", "--board", "arty", "-o", tmp_path / "x"
    )
    assert "18 to 32" in refused(
        capsys, "compile", "complementary", "--word", "17", "-o", tmp_path / "x"
    )
    assert "small" in refused(
        capsys, "compile", "complementary", "--config", "huge", "-o", tmp_path / "x"
    )
    assert "0 to 32" in refused(capsys, "run", "complementary", log, "--param", "kp_pitch_per_s=33")
    assert "NAME=NUMBER" in refused(capsys, "run", "complementary", log, "--param", "kp=x")
    assert "float, fixed" in refused(capsys, "run", "complementary", log, "--on", "gpu")
    assert "absent.csv" in refused(capsys, "check", "complementary", tmp_path / "absent.csv")
    refused(capsys, "check", "complementary")
    refused(capsys, "fly")
    assert not list((tmp_path / "x").glob("*")) if (tmp_path / "x").exists() else True


def test_output_that_cannot_be_written(log, capsys, tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("")
    assert "file" in refused(capsys, "compile", "complementary", "-o", blocker)
    assert "file" in refused(capsys, "run", "complementary", log, "-q", "-o", blocker / "out.csv")
    assert blocker.read_text() == ""


def test_run_writes_a_row_per_row(log, capsys, tmp_path):
    out = tmp_path / "out.csv"
    rows = {}
    for level in ("float", "fixed", "c"):
        assert main(["run", "complementary", str(log), "--on", level, "-o", str(out)]) == 0
        lines = out.read_text().splitlines()
        names = "pitch[deg],roll[deg],heading[deg],qw,qx,qy,qz,status[bits]"
        assert lines[0] == f"t[s],{names}"
        assert len(lines) == 21
        rows[level] = lines
    assert rows["fixed"] == rows["c"]
    for a, b in zip(rows["float"][1:], rows["fixed"][1:], strict=True):
        assert float(a.split(",")[3]) == pytest.approx(float(b.split(",")[3]), abs=1e-4)
    capsys.readouterr()


def test_check_json_is_one_object(log, capsys):
    assert main(["check", "complementary", str(log), "--levels", "fixed,c", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["good"] is True
    assert [v["n_mismatch"] for v in data["results"][0]["verification"]] == [0, 0]


def test_check_prints_a_line_per_level(log, capsys):
    assert main(["check", "complementary", str(log), "--levels", "fixed,c", "-q"]) == 0
    text = capsys.readouterr().out
    assert len(re.findall(r"\[0/20\] mismatches", text)) == 2
    assert text.rstrip().endswith("good")


def test_compile_writes_everything(capsys, tmp_path):
    out = tmp_path / "build"
    assert main(["compile", "complementary", "--board", "mimas", "-q", "-o", str(out)]) == 0
    names = {p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file()}
    expected = [*core_files(["complementary"]), *project_files("mimas", system=True)]
    assert names == {*expected, ".boresight.json"}
    assert {
        "core.v",
        "core_sim.v",
        "microcode.lst",
        "program.json",
        "schedule.json",
        "report.json",
        "firmware/complementary.c",
        "ise-mimas/build.sh",
    } <= names
    assert "DSP48A1" in (out / "core.v").read_text()
    for file in ("core.v", "core_sim.v"):
        assert (out / file).read_text().startswith("// core: ")
    assert "DSP48A1 " not in (out / "core_sim.v").read_text()
    data = json.loads((out / "report.json").read_text())
    assert data["timing"]["latency_cycles"]["predicted"] <= 300
    capsys.readouterr()


def test_list_and_doctor(capsys):
    assert main(["list", "--json"]) == 0
    names = [e["name"] for e in json.loads(capsys.readouterr().out)["estimators"]]
    assert names == [
        "complementary",
        "complementary_as_printed",
        "ekf_bias",
        "ekf_quaternion",
        "ekf_quaternion_vector",
        "mekf",
    ]
    assert main(["doctor", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["good"] is True


def test_bench_compares(capsys):
    from boresight.verbs.bench import bench

    data = bench(updates=4000, runs=400)
    assert data["updates_compared"] == 4000 and data["mismatches"] == 0
    capsys.readouterr()


def test_demo_proves_every_filter_on_one_core(tmp_path, monkeypatch):
    module, names = import_module("boresight.verbs.demo"), ("complementary", "mekf")
    # The larger core is synthesised, for both; `make` does each.
    larger = shared_core([estimator(n) for n in names], config="fast", restarts=1)
    area = module.estimate_core(larger)
    monkeypatch.setattr(module, "estimate_core", lambda core: area)
    monkeypatch.setattr(module, "BOARD_S", 0.05)
    data = boresight.demo(names, steps=20, restarts=1, output=tmp_path)
    assert data["good"] is True
    assert [(r["config"], r["estimator"]) for r in data["filters"]] == [
        (c, e) for c in ("small", "fast") for e in names
    ]
    for row in data["filters"]:
        assert row["mismatches"] == 0 and row["updates_proven"]["verilator"] == 20
        assert Path(row["report"]).is_file()
    for core in data["cores"]:
        assert (tmp_path / f"core-{core['config']}" / "core.v").is_file()
        report = json.loads((tmp_path / f"core-{core['config']}" / "report.json").read_text())
        assert report["resources"]["lut"] == core["lut"]
        assert list(report["programs"]) == ["complementary", "mekf"]
    assert json.loads((tmp_path / "summary.json").read_text()) == data
    assert summary_table(data).count("mekf") == 3  # two cores and the board
    assert [(r["filter"], r["good"]) for r in data["board"]] == [
        ("complementary", True),
        ("mekf", True),
    ]
    assert (tmp_path / "board" / "board.html").is_file()
    assert main(["demo", "--steps", "0", "-o", str(tmp_path)]) == 2


def test_bundled_logs_are_found():
    assert bundled("ximu_walk").exists()
