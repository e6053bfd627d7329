"""`boresight report`: what is checked, what is written, and when it is no success."""

from __future__ import annotations

import importlib
import json
from functools import partial
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.disk.manifest import NAME
from boresight.model.errors import InputError
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build
from boresight.sim.records.bundled import bundled

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.report")
LOG = str(bundled("synthetic_60s"))


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rough schedule, and no simulator is built: test_demo.py writes pages of all levels."""
    monkeypatch.setattr(module, "Build", partial(Build, restarts=0))
    monkeypatch.setattr(module, "Check", partial(Check, levels=("fixed", "c")))


def test_page_and_json_of_the_same_figures(tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    words = ["report", "complementary", LOG, "--steps", "20", "--no-synth", "--json"]
    assert main([*words, "-o", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == [NAME, "report.html", "report.json"]
    data = json.loads((out / "report.json").read_text())
    assert [v["n_total"] for v in data["verification"]] == [20, 20]
    assert data["design"] == "complementary" and data["config"] == "small"
    page = (out / "report.html").read_text()
    assert "<script" not in page and "complementary" in page
    assert json.loads(capsys.readouterr().out) == data


@pytest.mark.parametrize(
    ("levels", "verdict", "code"), [([True, True], True, 0), ([True, False], True, 1),
                                    ([True, True], False, 1)]
)  # fmt: skip
def test_all_of_it_has_to_be_good(levels, verdict, code, monkeypatch, capsys) -> None:
    asked = {}

    def report(name: str, log: str, **options: object) -> dict[str, object]:
        asked.update(options, name=name, log=log)
        return {
            "verification": [{"good": good} for good in levels],
            "accuracy": {"verdict": {"good": verdict}},
        }

    monkeypatch.setattr(module, "report", report)
    assert main(["report", "mekf", "a.csv", "--comparison", "--word", "24", "-q"]) == code
    assert asked | {"params": {}} == {
        **{"name": "mekf", "log": "a.csv", "config": "small", "word": 24, "steps": None},
        **{"synth": True, "output": "build", "comparison": True, "params": {}, "progress": None},
    }


def test_nothing_is_written_of_what_is_refused(tmp_path: Path) -> None:
    for change, message in (
        ({"steps": 0}, "^steps: wanted 1 or more"),
        ({"config": "huge"}, "^config: wanted one of small, fast"),
        ({"word": 17}, "^word: wanted 18 to 32"),
    ):
        with pytest.raises(InputError, match=message):
            module.report("mekf", LOG, output=tmp_path / "out", **change)
    assert not (tmp_path / "out").exists()
