"""Two reports side by side."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from boresight.gateware.core import Core
from boresight.model.errors import InputError
from boresight.sim.report.against import against_section, read_report
from boresight.sim.report.data import report_data


def test_the_same_run_twice(report: dict[str, Any]) -> None:
    found = against_section(report, report)
    assert found["rows"] == [] and found["equal"] > 50
    assert found["before"]["digest"] == report["digest"]


def test_what_differs_has_its_row(report: dict[str, Any]) -> None:
    after = copy.deepcopy(report)
    after["timing"]["latency_cycles"]["predicted"] *= 2
    after["resources"]["lut"] = None
    after["config"] = "small"
    after["timing"]["fmax_mhz"]["-2"]["p75"] = 100.0
    after["accuracy"]["verdict"]["outputs"][0]["max"] = 0.0
    row = next(r for r in after["numerics"] if r["signal"] == "gx")
    row["format"] = "fixed<32,-3>"
    found = against_section(report, after)
    rows = {r["figure"]: (r["before"], r["after"], r["ratio"]) for r in found["rows"]}
    output = report["accuracy"]["verdict"]["outputs"][0]
    cycles = report["timing"]["latency_cycles"]["predicted"]
    assert rows == {
        "latency": (cycles, 2 * cycles, 2.0),
        "LUT": (803, None, None),
        "configuration": ("fast", "small", None),
        "clock, slow nets": (80.0, 100.0, 1.25),
        f"error of {output['output']}, largest": (output["max"], 0.0, None),
        "integer bits of gx": (7, -3, None),
    }
    assert found["equal"] == against_section(report, report)["equal"] - len(rows)


def test_what_only_one_report_has(report: dict[str, Any], core: Core) -> None:
    rows = against_section(report_data(core), report)["rows"]
    new = {r["figure"]: (r["before"], r["after"]) for r in rows}
    assert new["DSP"] == (None, 8) and new["clock, slow nets"] == (None, 80.0)
    assert new["updates that saturated"] == (None, 0)
    assert any(name.endswith("against truth on synthetic_60s, rms") for name in new)


def test_files(report: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(json.dumps(report))
    assert read_report(path) == report
    for text in ("{", "[]", '{"design": "x"}', "\xff"):
        path.write_text(text)
        with pytest.raises(InputError, match=r"report.json: wanted a report.json of boresight"):
            read_report(path)
    with pytest.raises(InputError, match=r"^.*none\.json: wanted a report\.json"):
        read_report(tmp_path / "none.json")
