"""`boresight report`: what is checked, what is written, and when it is no success."""

from __future__ import annotations

import functools
import importlib
import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from boresight import ReportResult
from boresight.cli import main
from boresight.gateware.synthesis.routed import Mapped
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.model.tools.files import MANIFEST
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build
from boresight.sim.records.bundled import bundled

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.report")
LOG = str(bundled("synthetic_60s"))


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rough schedule, and no simulator is built: test_demo.py writes pages of all levels."""
    monkeypatch.setattr(module, "Build", partial(Build))
    monkeypatch.setattr(module, "Check", partial(Check, levels=("fixed", "c")))


def test_page_and_json_of_the_same_figures(tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    words = ["report", "complementary", LOG, "--steps", "20", "--no-synth", "--json"]
    assert main([*words, "-o", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == [MANIFEST, "report.html", "report.json"]
    data = json.loads((out / "report.json").read_text())
    assert [v["n_total"] for v in data["verification"]] == [20, 20]
    assert data["design"] == "complementary" and data["config"] == "small"
    page = (out / "report.html").read_text()
    assert "<script" not in page and "complementary" in page
    assert json.loads(capsys.readouterr().out) == data


@pytest.mark.parametrize(
    ("verdict", "code", "lines"),
    [("good", 0, ["report.html"]), ("FAILED: why", 1, ["report.html", "FAILED: why"])],
)
def test_all_of_it_has_to_be_good(verdict, code, lines, monkeypatch, capsys) -> None:
    asked = {}

    @functools.wraps(module.report)
    def report(name: str, *logs: str, **options: object) -> ReportResult:
        asked.update(options, name=name, logs=logs)
        return ReportResult(Path("report.html"), {}, verdict)

    monkeypatch.setattr(module.VERB, "modes", (report,))
    words = ["report", "mekf", "a.csv", "b.csv", "--comparison", "--widths", "--against", "r.json"]
    assert main([*words, "--word", "24", "--no-synth", "-q"]) == code
    assert capsys.readouterr().out.splitlines() == lines
    assert asked == {
        **{"name": "mekf", "logs": ("a.csv", "b.csv"), "word": 24, "widths": True},
        **{"against": "r.json", "synth": False, "comparison": True, "progress": None},
    }


def test_nothing_is_written_of_what_is_refused(tmp_path: Path) -> None:
    (tmp_path / "deep.json").write_text("[" * 100_000)
    for change, message in (
        ({"against": tmp_path / "deep.json"}, "deep.json: wanted a report.json .* nested too deep"),
        ({"steps": 0}, "^steps: wanted 1 or more"),
        ({"config": "huge"}, "^config: wanted one of small, fast"),
        ({"word": 17}, "^word: wanted 18 to 32"),
        ({"against": LOG}, "synthetic_60s.csv: wanted a report.json of boresight report"),
    ):
        with pytest.raises(InputError, match=message):
            module.report("mekf", LOG, output=tmp_path / "out", **change)
    with pytest.raises(InputError, match="^logs: wanted at least one log"):
        module.report("mekf", output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


FILTER = """
from boresight import Estimator, Input, Output
from helper import twice


class Double(Estimator):
    inputs = (Input("u", -1.0, 1.0, ""),)
    outputs = (Output("y", "", tolerance=1e-6),)

    def step(self, x, u, p):
        return {}, {"y": twice(u.u)}
"""


def test_logs_widths_another_run_and_lines_of_ones_own_filter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "helper.py").write_text("def twice(u):\n    return 2.0 * u\n")
    (tmp_path / "my double.py").write_text(FILTER)
    (tmp_path / "logs").mkdir()
    for name in ("one", "two"):
        (tmp_path / "logs" / f"{name}.csv").write_text("u\n0.25\n-0.5\n")
    monkeypatch.setattr(module, "width_section", partial(module.width_section, widths=(18,)))
    name, logs, out = f"{tmp_path}/my double.py", tmp_path / "logs", tmp_path / "deep" / "er"
    used = {"lut": 700, "ff": 400, "dsp": 4, "ram": 6}
    made: dict[str, Any] = {"netlist": {}, "used": used, "inside": 0, "version": "", "command": ""}
    monkeypatch.setattr(module, "map_core", lambda core, part: Mapped(target=part, **made))
    first = module.report(name, logs / "one.csv", target="lifcl-17", output=out)
    assert first.report["resources"]["lut"] == 700 and first.report["timing"]["fmax_mhz"] is None
    assert first.report["target"]["device"] == "lifcl-17"
    page = (out / "report.html").read_text("utf-8")
    assert "<td>MULT18X18</td>" in page and "--target lifcl-17 --route" in page
    assert "ISE" not in page and "DSP48A1" not in page
    result = module.report(
        name,
        logs,
        {"u": [1.0]},
        synth=False,
        widths=True,
        against=out / "report.json",
        output=out,  # over the report that it is compared with
    )
    assert result.good and result.page == out / "report.html"
    assert "report.html" in result._repr_html_()
    data = result.to_json()
    assert [log["dataset"] for log in data["accuracy"]["logs"]] == ["one", "two", "record"]
    assert [p["word"] for p in data["widths"]["points"]] == [18]
    assert first.report["widths"] is None and first.report["against"] is None
    rows = {r["figure"]: (r["before"], r["after"]) for r in data["against"]["rows"]}
    assert {f: rows[f] for f in ("two: log", "record: log")} == {
        "two: log": (None, "two"),
        "record: log": (None, "record"),
    }
    page = (out / "report.html").read_text()
    assert 'href="../../my%20double.py#L7">my double.py, line 7</a>' in page
    assert 'href="../../helper.py#L2">helper.py, line 2</a>' in page
    for href in ("my double.py", "helper.py"):
        assert (out / "../.." / href).is_file()


def test_no_link_to_what_is_not_ones_own(tmp_path: Path) -> None:
    assert module.links_of(estimator_of("mekf"), tmp_path) == {}


def test_no_link_to_one_of_two_files_of_one_name(tmp_path: Path) -> None:
    members: dict[str, object] = {}
    for name in ("a/same.py", "b/same.py", "b/other.py", "b/gone.py"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        if "gone" not in name:
            path.touch()
        exec(compile("def f(self): ...", path, "exec"), results := {})
        members[name.replace("/", "_")] = results["f"]
    mine = type("Mine", (Estimator,), {**members, "__module__": "nowhere"})
    assert module.links_of(mine(), tmp_path / "out") == {"other.py": "../b/other.py"}
