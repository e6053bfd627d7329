"""`boresight fit`, and the verbs that take its profile."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

import boresight
from boresight.cli import main
from boresight.model.resolve import estimator_of
from boresight.sim.levels.build import Build
from boresight.sim.records.log import Log

SOURCE = """
from boresight import Estimator, Input, Output, State, World, ops


class Unit(Estimator):
    inputs = (Input("a", -40.0, 40.0), Input("b", -40.0, 40.0))
    states = (State("x", -1.0, 1.0),)
    outputs = (Output("x", tolerance=1e-6),)

    def step(self, x, u, p):
        norm = ops.rsqrt(u.a * u.a + u.b * u.b)
        claim = ops.bounded(u.a * norm, -1.5, 1.5, "unit vector")
        new = 0.5 * x.x + 0.25 * claim + 0.25 * u.b * norm
        return {"x": new}, {"x": new}


class Plant(World):
    def start(self):
        self.n = 0

    def record(self, outputs):
        self.n += 1
        return {"a": float(self.n), "b": 2.0} if self.n < 30 else None
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("unit.py").write_text(SOURCE)
    rows = [f"{0.1 * k},{k % 9 + 1},{k % 5 - 2}" for k in range(50)]
    Path("log.csv").write_text("\n".join(["t,a,b", *rows]) + "\n")
    return tmp_path


def test_a_log_in_pieces_gives_the_same_profile(folder: Path, monkeypatch) -> None:
    """Also the digest of what it was made from."""
    boresight.fit("unit.py:Unit", "log.csv", output="whole.json")
    blocks = Log.blocks
    monkeypatch.setattr(Log, "blocks", lambda self, rows: blocks(self, 7))
    result = boresight.fit("unit.py:Unit", "log.csv", output="pieces.json")
    assert result.records == {"log": 50}
    assert Path("pieces.json").read_bytes() == Path("whole.json").read_bytes()


def test_what_it_writes_is_found_and_makes_it_compile(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    check = ["check", "unit.py:Unit", "log.csv", "--levels", "c", "-q"]
    assert main(check) == 2
    assert "wanted a finite range" in capsys.readouterr().err
    assert main(["fit", "unit.py:Unit", "log.csv", "-q"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("unit.fit.json: ") and "from log (50 updates)" in text
    assert "input b (unit.py, line 6) wastes 2 bits: narrow its range to [-15.98, 15.98]" in text
    assert main(check) == 0
    capsys.readouterr()
    assert main([*check, "--no-profile"]) == 2
    os.replace("unit.fit.json", "other.json")
    assert main(check) == 2
    assert main([*check, "--profile", "other.json"]) == 0
    capsys.readouterr()
    assert main([*check, "--profile", "other.json", "--no-profile"]) == 2
    assert "wanted a profile, or --no-profile, found both" in capsys.readouterr().err


ENERGY = """
from boresight import Estimator, Input, Output, Param, State


class Energy(Estimator):
    inputs = (Input("a", -10.0, 10.0), Input("b", -10.0, 10.0))
    params = (Param("k", 0.1, 0.0, 10.0),)
    states = (State("s", -1e6, 1e6),)
    outputs = (Output("y", tolerance=1e-2),)

    def step(self, x, u, p):
        e = u.a * u.a * u.b * u.b * p.k
        s = 0.99 * x.s + e
        return {"s": s}, {"y": s * 0.001 + e}
"""


def test_compile_and_check_name_the_profile_that_they_use(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("energy.py").write_text(ENERGY)
    Path("small.csv").write_text("a,b\n" + "".join(f"{0.01 * k},0.5\n" for k in range(50)))
    assert main(["fit", "energy.py", "small.csv", "-q"]) == 0
    capsys.readouterr()
    named = re.compile(r"profile energy.fit.json: formats of \d values, observed in small; beyond")
    assert main(["compile", "energy.py", "-o", "build", "-q"]) == 0
    assert named.search(capsys.readouterr().out)
    assert main(["check", "energy.py", "small.csv", "--levels", "c", "-q"]) == 0
    assert named.search(capsys.readouterr().out)
    text = Path("build/README.md").read_text()
    assert "**Assumed ranges.**" in text and "\n| `y` | -" in text


def test_a_profile_of_another_step_is_refused_and_made_anew(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fit = ["fit", "unit.py:Unit", "log.csv", "-q"]
    assert main(fit) == 0
    Path("unit.py").write_text(SOURCE.replace("0.5 *", "0.25 *"))
    assert main(["compile", "unit.py:Unit", "-o", "build"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: unit.fit.json: wanted a profile of unit as it is now")
    assert not Path("build").exists()
    assert main(fit) == 0
    Path("unit.py").write_text("# a comment\n" + SOURCE.replace("0.5 *", "0.25 *"))
    assert main(["run", "unit.py:Unit", "log.csv", "-o", "out.csv"]) == 0


def test_the_data(folder: Path) -> None:
    result = boresight.fit("unit.py:Unit", "log.csv", "unit.py:Plant")
    data = json.loads(Path("unit.fit.json").read_text())
    assert result.records == {"log": 50, "plant": 29}
    plan = Build(estimator_of("unit.py:Unit")).core.schedule
    assert result.cycles == (None, (plan.latency, plan.interval))
    assert f"scheduler: latency - cycles, with it {plan.latency}; interval -, with" in str(result)
    assert [x["log"] for x in data["made_from"]] == ["log", "plant"]
    assert len(data["values"]) == result.formats and result.good
    assert "wanted a finite range" in result.refused
    (error,) = result.errors
    assert error.before is None and error.after is not None and error.after < 1e-8
    row = data["values"][0]
    assert row["line"].startswith("unit.py, line ") and row["records"][0] <= row["records"][1]


def test_its_own_profile_is_not_asked(folder: Path) -> None:
    """A second run sees what the first saw."""
    first = boresight.fit("unit.py:Unit", "log.csv")
    text = Path("unit.fit.json").read_text()
    assert boresight.fit("unit.py:Unit", "log.csv").to_json() == first.to_json()
    assert Path("unit.fit.json").read_text() == text


def test_the_profile_of_an_estimator_without_a_file(folder: Path) -> None:
    result = boresight.fit("unit.py:Unit", "log.csv", output="elsewhere.json")
    assert result.profile == Path("elsewhere.json")
    assert not Path("unit.fit.json").exists()


def test_no_source_is_refused() -> None:
    with pytest.raises(boresight.InputError, match="wanted at least one log or world"):
        boresight.fit("mekf")


def test_processes_take_the_profile(folder: Path) -> None:
    """Those that a campaign starts, too."""
    from boresight.model.resolve import profiles, profiles_now
    from boresight.sim.campaign import dispatch

    with profiles(["a.json"]):
        results = dict(dispatch(2, [("one", profiles_now, ()), ("two", profiles_now, ())]))
    assert results == {"one": ("a.json",), "two": ("a.json",)}


def test_verdicts(folder: Path) -> None:
    result = boresight.fit("unit.py:Unit", "log.csv")
    assert result.good and result.negative_updates == (None, 0) and "exact" not in str(result)
    bad = replace(result, negative_updates=(0, 3))
    assert not bad.good and "NEGATIVE after 3 hostile updates, 0 without it" in str(bad)
    assert replace(result, negative_updates=(3, 3)).good
    error = replace(result.errors[0], before=1.0, after=1.05, tolerance=1.1)
    assert error.verdict == "" and replace(error, after=None).verdict == ""
    assert replace(error, after=1.2).verdict == ", BEYOND 1.1, less exact with it"
    assert "no error changes" not in str(replace(result, errors=(error,)))
    assert "no error changes" in str(replace(result, errors=(replace(error, after=1.0),)))


def test_a_profile_that_failed_is_not_written(folder: Path, capsys) -> None:
    Path("unit.py").write_text(SOURCE.replace("0.5 * x.x", "x.x"))  # x grows beyond its range
    assert main(["fit", "unit.py:Unit", "log.csv", "-q"]) == 1
    assert re.search(r"\nFAILED, not written: \d+ updates SATURATED", capsys.readouterr().out)
    assert not Path("unit.fit.json").exists()
