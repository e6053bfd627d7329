"""What a compilation tells about latencies, area and clock."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from boresight.results.compile import CompiledProgram, CompileResult, Proven, TargetFigures

CORE = TargetFigures("xc6slx9", {"lut": 515}, None, {}, "515 LUT6", {"median": 129.9, "p75": 95.2})
SYSTEM = TargetFigures("xc6slx9", {"lut": 1791}, None, {}, "1,791 LUT6")
RESULT = CompileResult(
    output=Path("build"),
    config="small",
    word=32,
    digest="0123",
    programs=(CompiledProgram("a", {"pos": 24, "vel": 26}, 31), CompiledProgram("b", {"x": 9}, 12)),
    proven=Proven(318, True, 0.27),
    core=CORE,
    system=SYSTEM,
    report={"digest": "0123"},
)


def test_text() -> None:
    assert str(RESULT).splitlines() == [
        "build: a: pos 24, vel 26 cycles; interval 31, at 100 MHz up to 3,225,806 updates/s",
        "build: b: x 9 cycles; interval 12, at 100 MHz up to 8,333,333 updates/s",
        "proven: 318 operations, microcode and C, all inputs  0.3 s",
        "core: 515 LUT6",
        "on the board: 1,791 LUT6",
    ]


@pytest.mark.parametrize(
    ("rate", "said", "failed"),
    [
        (1e5, "busy 3.1 % at 100,000 Hz", ""),
        (4e6, "busy 124 % at 4,000,000 Hz, TOO SLOW", "FAILED: a is busy 124 % at 4,000,000 Hz"),
    ],
)
def test_a_planned_rate(rate: float, said: str, failed: str) -> None:
    result = dataclasses.replace(RESULT, rate_hz=rate)
    first, *_, last = str(result).splitlines()
    assert first.endswith(said) and (last == failed or not failed and "FAILED" not in last)
    assert result.good is not failed.startswith("FAILED") and RESULT.good


def test_data_and_table() -> None:
    assert RESULT.to_json() is RESULT.report
    page = RESULT._repr_html_()
    assert "<td>a</td><td>vel</td><td>26</td>" in page and "<td>1,791</td>" in page
    json.dumps(RESULT._shown())
