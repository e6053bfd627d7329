"""`sim.result.baseline`: what is worse than in an earlier result, and what only differs."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest

from boresight.model.errors import InputError
from boresight.sim.result import Figure, Result, baseline, compared

JUDGED = {
    "word": Figure("word", "same"),
    "good": Figure("good", "count", falls=True),
    "rows.*.max": Figure("rounding", "rounding"),
    "rows.*.truth": Figure("error from the truth", "truth"),
    "latency.*": Figure("latency", "cycles", "cycles"),
    "area.lut": Figure("LUT", "area"),
    "area.mhz": Figure("clock", "clock", "MHz", falls=True),
    "parameters.*": Figure("value", "parameter"),
    "tolerances.*": Figure("tolerance", "identity"),
    "digest": Figure("program", "identity"),
}
BEFORE: dict[str, Any] = {
    "word": 32,
    "good": True,
    "rows": [
        {"output": "pos", "unit": "m", "max": 1e-6, "tolerance": 1e-4, "truth": 0.2},
        {"output": "vel", "unit": "m/s", "max": 0.0, "tolerance": None, "truth": None},
    ],
    "latency": {"pos": 100, "vel": 102},
    "area": {"lut": 500, "mhz": 130.0},
    "parameters": {"gain": 0.3},
    "digest": "a",
}


@pytest.mark.parametrize(
    ("place", "value", "worse"),
    [
        (("latency", "pos"), 101, "worse than old.json: pos: latency 100 -> 101 cycles"),
        (("latency", "pos"), 99, ""),
        (("area", "lut"), 505, ""),
        (("area", "lut"), 506, "worse than old.json: LUT 500 -> 506"),
        (("area", "lut"), None, "worse than old.json: LUT 500 -> none"),
        (("area", "mhz"), 124.0, ""),
        (("area", "mhz"), 120.0, "worse than old.json: clock 130 -> 120 MHz"),
        # Another rounding passes within the tolerance, whatever the earlier one was.
        (("rows", 0, "max"), 9e-5, ""),
        (("rows", 0, "max"), 2e-4, "worse than old.json: pos: rounding 1e-06 -> 0.0002 m"),
        (("rows", 1, "max"), 1e-12, ""),
        (("rows", 0, "truth"), 0.21, ""),
        (("rows", 0, "truth"), 0.5, "worse than old.json: pos: error from the truth 0.2 -> 0.5 m"),
        (("good",), False, "worse than old.json: good 1 -> 0"),
        (("parameters", "gain"), 0.300001, "not as in old.json: gain: value 0.3 -> 0.300001"),
        (("parameters", "gain"), None, "not as in old.json: gain: value 0.3 -> none"),
        (("digest",), "b", ""),
    ],
)
def test_what_is_worse(place: tuple[Any, ...], value: Any, worse: str) -> None:
    now = copy.deepcopy(BEFORE)
    entry: Any = now
    for key in place[:-1]:
        entry = entry[key]
    entry[place[-1]] = value
    found = compared(now, BEFORE, JUDGED, file="old.json")
    assert found.failures == ([worse] if worse else [])
    assert found.good is (not worse) and len(found["changes"]) == (place != ("digest",))


def test_a_changed_program_is_said_and_not_judged() -> None:
    now = {**BEFORE, "digest": "b", "tolerances": {"pos": 0.01, "vel": 0.01}}
    before = {**BEFORE, "tolerances": {"pos": 0.0001}}
    found = compared(now, before, JUDGED, file="old.json")
    assert found.good
    assert found.notes == [
        "pos: tolerance has changed: 0.0001 to 0.01",
        "program has changed: a to b",
    ]
    assert "program has changed" in str(found)


def test_a_loosened_tolerance_is_said_and_does_not_hide_a_worse_figure() -> None:
    now = copy.deepcopy(BEFORE)
    now["rows"][0]["tolerance"] = 1e-2
    found = compared(now, BEFORE, JUDGED, file="f")
    assert found.good and found.notes == [
        "pos: rounding: its tolerance has changed: 0.0001 to 0.01 m"
    ]
    equal = compared(BEFORE, BEFORE, JUDGED, file="f")["equal"]
    assert found["equal"] == equal
    now["rows"][0] |= {"max": 2e-3, "tolerance": None}
    found = compared(now, BEFORE, JUDGED, file="f")
    assert found.failures == ["worse than f: pos: rounding 1e-06 -> 0.002 m"]
    assert "0.0001 to none m" in found.notes[0]


def test_names_stand_once_and_a_falling_figure_has_a_minus() -> None:
    judged = {"rows.*.samples": Figure("samples", "count", falls=True)}
    before, now = (
        {"rows": [{"design": "slip", "estimator": "slip", "unit": "m/s", "samples": n}]}
        for n in (1500, 799)
    )
    (row,) = compared(now, before, judged, file="f").tables["changes"]
    assert row["figure"] == "slip: samples" and row["unit"] is None
    assert row["change"] == "-46.7%" and row[""] == "WORSE"


def test_a_parameter_has_every_digit() -> None:
    now = {**BEFORE, "parameters": {"gain": 0.3000001}}
    (row,) = compared(now, BEFORE, JUDGED, file="f").tables["changes"]
    assert (row["before"], row["now"]) == ("0.3", "0.3000001")


def test_a_missing_output_is_worse_and_a_new_one_is_shown() -> None:
    less = {**BEFORE, "rows": BEFORE["rows"][:1]}
    assert not compared(less, BEFORE, JUDGED, file="f").good
    found = compared(BEFORE, less, JUDGED, file="f")
    assert found.good and [c["figure"] for c in found["changes"]] == ["vel: rounding"]


def test_results_of_another_width_are_not_compared(tmp_path) -> None:
    with pytest.raises(InputError, match="of the same word, 24,"):
        compared({**BEFORE, "word": 24}, BEFORE, JUDGED, file="f")
    path = tmp_path / "old.json"
    path.write_text(json.dumps(BEFORE))
    result = Result(BEFORE, judged=JUDGED)
    assert baseline(result, path).good
    path.write_text('{"a": 1}')
    with pytest.raises(InputError, match="wanted an earlier result"):
        baseline(result, path)
