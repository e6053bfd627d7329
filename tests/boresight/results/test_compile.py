"""What a compilation tells about latencies, area and clock."""

from __future__ import annotations

import json
from pathlib import Path

from boresight.results.compile import CompiledProgram, CompileResult, CoreFigures

CORE = CoreFigures(515, 361, 4, 14.0, {"median": 129.9, "p75": 95.2})
SYSTEM = CoreFigures(1791, 1500, 4, 17.5, {"median": 110.0, "p75": None})
RESULT = CompileResult(
    output=Path("build"),
    config="small",
    word=32,
    digest="0123",
    programs=(CompiledProgram("a", {"pos": 24, "vel": 26}, 31), CompiledProgram("b", {"x": 9}, 12)),
    core=CORE,
    system=SYSTEM,
    report={"digest": "0123"},
)


def test_text() -> None:
    assert str(RESULT).splitlines() == [
        "build: a: pos 24, vel 26 cycles",
        "build: b: x 9 cycles",
        "complete system: 1791 LUT, 1500 FF, 4 DSP48A1, 17.5 RAMB16; clock 110.0 MHz "
        "(estimate, -2, median nets; None with 75th percentile nets)",
    ]


def test_data_and_table() -> None:
    assert RESULT.to_json() is RESULT.report
    page = RESULT._repr_html_()
    assert "<td>a</td><td>vel</td><td>26</td>" in page and "<td>1,791</td>" in page
    json.dumps(RESULT._shown())
