"""`sim.baseline`: what got worse between two results, in which direction, by how much."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest

from boresight.model.errors import InputError
from boresight.sim.baseline import Figure, compared, read_baseline

JUDGED = {
    "word": Figure("word", "same"),
    "good": Figure("good", "count", falls=True),
    "rows.*.max": Figure("largest error", "error"),
    "rows.*.samples": Figure("samples", "count", falls=True),
    "latency.*": Figure("latency", "cycles", "cycles"),
    "area.lut": Figure("LUT", "area"),
    "area.mhz": Figure("clock", "clock", "MHz", falls=True),
    "digest": Figure("program", ""),
}
BEFORE: dict[str, Any] = {
    "word": 32,
    "good": True,
    "rows": [
        {"output": "pos", "unit": "m", "max": 1e-6, "samples": 400},
        {"output": "vel", "unit": "m/s", "max": 0.0, "samples": 400},
    ],
    "latency": {"pos": 100, "vel": 102},
    "area": {"lut": 500, "mhz": 130.0},
    "digest": "a",
}


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        # 5 cycles, 3 % of area, a doubled error: what a test in CI is for.
        (("latency", "pos"), 105, ["pos: latency"]),
        (("latency", "pos"), 101, ["pos: latency"]),
        (("latency", "pos"), 99, []),
        (("area", "lut"), 515, ["LUT"]),
        (("area", "lut"), 505, []),
        (("area", "lut"), 506, ["LUT"]),
        (("area", "lut"), None, ["LUT"]),
        (("area", "mhz"), 124.0, []),
        (("area", "mhz"), 120.0, ["clock"]),
        (("area", "mhz"), 150.0, []),
        (("rows", 0, "max"), 2e-6, ["pos: largest error"]),
        (("rows", 0, "max"), 1.09e-6, []),
        (("rows", 0, "max"), 1e-9, []),
        (("rows", 1, "max"), 1e-12, ["vel: largest error"]),
        (("rows", 0, "samples"), 399, ["pos: samples"]),
        (("rows", 0, "samples"), 800, []),
        (("rows",), [], ["largest error", "samples"]),
        (("good",), False, ["good"]),
        (("digest",), "b", []),
    ],
)
def test_what_is_worse(place: tuple[Any, ...], value: Any, said: list[str]) -> None:
    now = copy.deepcopy(BEFORE)
    inner: Any = now
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    result = compared(now, BEFORE, JUDGED, file="old.json")
    names = {c.figure.rpartition(": ")[2] if place == ("rows",) else c.figure for c in result.worse}
    assert names == set(said) and result.good is not bool(said)
    assert result.changes
    text = str(result).splitlines()
    assert len(text) == 1 + len(result.changes) + bool(said)
    assert text[-1].startswith("FAILED: worse than old.json: ") is bool(said)


def test_shares_that_are_accepted() -> None:
    now = copy.deepcopy(BEFORE)
    now["area"]["lut"] = 550
    assert not compared(now, BEFORE, JUDGED, file="f", allow={"area": 0.09}).good
    result = compared(now, BEFORE, JUDGED, file="f", allow={"area": 0.1})
    assert result.good and "LUT 500 -> 550  +10.0%" in str(result)
    for allow in ({"areas": 1.0}, {"area": -0.1}, {"area": float("nan")}):
        with pytest.raises(InputError, match="a share from 0 up of one of cycles, area"):
            compared(now, BEFORE, JUDGED, file="f", allow=allow)


def test_what_is_new_is_told_and_is_no_fault() -> None:
    less = copy.deepcopy(BEFORE)
    del less["area"], less["rows"][1]
    result = compared(BEFORE, less, JUDGED, file="f")
    assert result.good and {c.figure for c in result.changes if c.before is None} == {
        "LUT", "clock", "vel: largest error", "vel: samples",
    }  # fmt: skip


def test_results_of_something_else_are_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"f: wanted an earlier result of the same word, 28"):
        compared(BEFORE | {"word": 28}, BEFORE, JUDGED, file="f")
    file = tmp_path / "f.json"
    file.write_text(json.dumps(BEFORE))
    assert read_baseline(file, JUDGED) == BEFORE
    for text, said in (("", "an empty file"), ("[1]", "a list"), ('{"x": 1}', "one of x")):
        file.write_text(text)
        with pytest.raises(InputError, match=f"wanted an earlier result.*found {said}"):
            read_baseline(file, JUDGED)


def test_two_entries_of_one_name_are_two_figures() -> None:
    twice = BEFORE | {"rows": [BEFORE["rows"][0], {**BEFORE["rows"][0], "max": 2e-6}]}
    worse = copy.deepcopy(twice)
    worse["rows"][1]["max"] = 4e-6
    (change,) = compared(worse, twice, JUDGED, file="f").worse
    assert (change.figure, change.before, change.now) == ("pos: largest error (2)", 2e-6, 4e-6)
