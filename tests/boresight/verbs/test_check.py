"""`boresight check`: what it compares, what it writes, and when it fails."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import boresight
from tests.support.strangers import STRANGERS, csv, program

BOTH = f"{program('kalman.py')},{program('pi.py:Pi')}"


def test_levels_of_a_log(here: Path, data, said) -> None:
    (result,) = data("check mine.py mine.csv --steps 60")["results"]
    levels = {v["level"]: v for v in result["verification"]}
    assert {*levels} == {"fixed", "c", "rtl"} and result["exact"]
    assert all(v["n_mismatch"] == 0 < v["n_total"] for v in result["verification"])
    assert levels["rtl"]["cycles_predicted"] == levels["rtl"]["cycles_max"]
    text = said("check mine.py mine.csv --levels fixed,c -q")
    assert text.count("[0/400] mismatches") == 1 and text.endswith("\ngood\n")


@pytest.mark.parametrize(
    "target", ["xc6slx9", "generic", "ecp5-25k", "ice40-up5k", "lifcl-17", "artix7-35t"]
)
def test_the_core_that_is_checked_is_the_one_that_compile_writes(here: Path, target: str) -> None:
    core = boresight.compile("mine.py", target=target, output="core")
    check = boresight.check("mine.py", "mine.csv", levels=("fixed",), target=target)
    (result,) = check.to_json()["results"]
    assert (result["config"], result["program"]) == (core["config"], core["digest"])
    assert result["identity"] == core["identity"]


def test_the_files_of_a_folder_are_what_runs(here: Path, data, said, refused, monkeypatch) -> None:
    identity = data("compile mine.py --param alpha=0.25 -o core")["identity"]
    line = "check core mine.csv --steps 20 --levels c,rtl"
    result = data(line)
    assert result["good"] and result["results"][0]["identity"] == identity
    assert boresight.check(Path("core"), "mine.csv", levels="c").good  # type: ignore[arg-type]
    assert "W = 32, core " + identity in said("check mine.py mine.csv --param alpha=0.25 -q")
    for option in ("--word 24", "--word 32", "--config small", "--target xc6slx9"):
        assert "wanted no --config" in refused(f"{line} {option}")
    files = [path for path in Path("core").rglob("*") if path.is_file()]
    for path in files:
        good = path.read_bytes()
        path.write_bytes(bytes([*good[:-9], good[-9] ^ 1, *good[-8:]]))
        assert f"FAILED: {path}: missing, or not as compile wrote it" in said(f"{line} -q", 1)
        path.write_bytes(good)
    # Without that list the forms themselves show that a file has changed.
    monkeypatch.setattr("boresight.builds.changed_files", lambda folder: [])
    for level, name, old, new in (
        ("rtl", "core.v", "32'd268435456;", "32'd299999999;"),  # alpha
        ("c", "firmware/mine.c", "acc -= ", "acc += "),
    ):
        path = Path("core") / name
        good = path.read_text()
        path.write_text(good.replace(old, new))
        (wrong,) = (x for x in said(f"{line} -q", 1).splitlines() if x.split()[0] == level)
        assert "[0/20]" not in wrong and "/20] mismatches" in wrong
        path.write_text(good)
    Path("mine.py").write_text(Path("mine.py").read_text().replace("16.0", "8.0"))
    assert "compile again" in refused(line)


def test_beyond_the_tolerance(here: Path, data, said) -> None:
    """A tolerance replaces the declared one, and no bit changes."""
    line = "check mine.py mine.csv --levels c --word 24"
    declared = data(line, 1)["results"][0]["accuracy"]["outputs"]
    given = data(f"{line} --tolerance pos=50cm --tolerance vel=9")["results"][0]["accuracy"]
    assert [o["tolerance"] for o in given["outputs"]] == [0.5, 9.0]
    assert [o["max"] for o in given["outputs"]] == [o["max"] for o in declared]
    assert said(f"{line} -q", 1).splitlines()[-1].startswith("FAILED: vel max ")


def test_a_name_longer_than_a_path_is_a_name(refused) -> None:
    assert "estimator: wanted file.py:Class" in refused(f"check {'a' * 300} log.csv")


def test_several_estimators_share_a_core(tmp_path: Path, data, refused) -> None:
    """Each with a log of its own, or one log for all."""
    logs = {
        name: csv(tmp_path / f"{name}.csv", STRANGERS[file](n))
        for name, file, n in (("kalman", "kalman.py", 70), ("pi", "pi.py:Pi", 50))
    }
    line = f"check {BOTH} --levels fixed,c"
    found = data(f"{line} pi={logs['pi']} kalman={logs['kalman']}")["results"]
    assert [r["estimator"] for r in found] == ["kalman", "pi"]
    assert [r["verification"][0]["n_total"] for r in found] == [70, 50]
    assert "a log of kalman, since pi has its own" in refused(f"{line} pi={logs['pi']}")
    columns = STRANGERS["kalman.py"](30)[0] | STRANGERS["pi.py:Pi"](30)[0]
    result = boresight.check(BOTH, columns, levels="fixed,c")
    assert result.good and len(result["results"]) == 2


def test_the_page(here: Path, said, refused) -> None:
    assert "out/report.html" in said("check mine.py mine.csv --levels fixed,c -o out -q")
    report = json.loads(Path("out/report.json").read_text())
    assert report["resources"]["lut"] > 100
    assert Path("out/report.html").read_text().count("mine.py") > 0
    refused("check mine.py out/report.html")


def test_logs_of_one_name_are_told_apart_by_their_folders(here: Path, data) -> None:
    for folder in ("a/run", "b/run", "c"):
        Path(folder).mkdir(parents=True)
        Path(folder, "mine.csv").write_text(Path("mine.csv").read_text())
    line = "check mine.py a/run/mine.csv b/run/mine.csv c --levels c --steps 9"
    assert [x["log"] for x in data(line)["results"]] == ["a/run/mine", "b/run/mine", "c/mine"]
