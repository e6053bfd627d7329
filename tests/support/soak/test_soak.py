"""The search for trouble: cases agree, a seeded fault is found, shrunk and replayed, runs go on."""

import dataclasses
import itertools
import time
import weakref
from pathlib import Path
from typing import Any

import pytest

from boresight.firmware.build import CModel
from tests.support.soak import compiler
from tests.support.soak import search as soak


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_ten_minutes() -> None:
    """Random programs for ten minutes."""
    end = time.monotonic() + 600.0
    for seed in itertools.count(10**6):
        case = compiler.drawn(seed, rtl=seed % 4 == 0)
        assert compiler.check(case) == "", case
        if time.monotonic() > end:
            break


@pytest.mark.parametrize("seed", [0, 5])
def test_a_case(seed: int) -> None:
    """Seed 0 found that the proof of C refused a table that is named and not read."""
    case = compiler.drawn(seed)
    assert compiler.check(case) == "" and compiler.drawn(seed) == case
    assert compiler.drawn(seed + 1) != case


def wrong_c(monkeypatch: pytest.MonkeyPatch) -> None:
    """C whose last output is one less in every third update of an object."""
    update = CModel.update

    counts = weakref.WeakKeyDictionary[CModel, int]()

    def off(self: CModel, rows: Any) -> Any:
        out, saturated = update(self, rows)
        counts[self] = counts.get(self, 0) + 1
        out[:, -1] -= counts[self] % 3 == 0
        return out, saturated

    monkeypatch.setattr(CModel, "update", off)


def test_a_fault_is_found_shrunk_written_and_replayed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = dataclasses.replace(compiler.drawn(5), programs=1, updates=9, n_ops=3)
    assert compiler.check(case) == ""
    wrong_c(monkeypatch)
    assert compiler.check(case).startswith("C: update 2 of random0: ")
    least = compiler.shrunk(case)
    assert (least.updates, least.n_ops, least.stall) == (3, 1, 0)
    path = compiler.write(least, "C", tmp_path)
    assert compiler.read(path) == least
    assert soak.main(["--replay", str(path)]) == 1 and "C: update 2" in capsys.readouterr().out
    monkeypatch.undo()
    assert soak.main(["--replay", str(path)]) == 0


def test_a_search_goes_on_and_its_page_says_what_ran(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = list[tuple[str, int]]()

    def run(kind: str, seed: int, folder: Path) -> dict[str, Any]:
        ran.append((kind, seed))
        wrong = ["seed 1 <fails>"] if kind != "compiler" and seed == 1 else []
        row = {"kind": kind, "seed": seed, "cases": 3, "seconds": 2.0, "wrong": wrong}
        now[0] += 1.0
        return row

    now = [0.0]
    monkeypatch.setattr(soak, "run", run)
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr(soak, "kinds", lambda: ["compiler", "tests/a.py", "tests/b.py"])
    command = ["--hours", str(3 / 3600), "--jobs", "1", "-o", str(tmp_path)]
    assert soak.main(command) == 0  # half of the files; the next two begin with the other one
    assert soak.main(command) == 0
    assert soak.main([*command, "--only", "tests/a"]) == 1
    files = ["tests/a.py 0", "tests/b.py 0", "tests/a.py 1", "tests/a.py 2", "tests/a.py 3"]
    assert [f"{kind} {seed}" for kind, seed in ran if kind != "compiler"] == files
    assert [seed for kind, seed in ran if kind == "compiler"] == [0, 1, 2, 3]
    text = (tmp_path / "soak.html").read_text()
    assert "1 findings in 0.01 hours" in text and "seed 1 &lt;fails&gt;" in text
    assert "1 findings in 9 tasks" in capsys.readouterr().out


def test_what_is_fuzzed_elsewhere_runs_too() -> None:
    kinds = soak.kinds()
    assert kinds[0] == "compiler" and "tests/sim/records/test_reader.py" in kinds
    assert not any(kind.startswith("tests/support") for kind in kinds)
    assert soak._pairs("..\n3 passed, 1 failed, 9 deselected in 2.1s\n") == (
        ["3", "1", "9"],
        ["passed,", "failed,", "deselected"],
    )
