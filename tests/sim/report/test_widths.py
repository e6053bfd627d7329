"""Errors over the width of the words."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.report import widths as module
from boresight.sim.report.widths import width_section

TOLERANCE = 2e-5


class Low(Estimator):
    """A low pass: its rounding adds up."""

    inputs = (Input("u", -1.0, 1.0, ""),)
    params = (Param("gain", 0.5, 0.0, 1.0, ""),)
    states = (State("y", -1.0, 1.0, ""),)
    outputs = (Output("y", "", tolerance=TOLERANCE),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """First order."""
        y = x.y + p.gain * (u.u - x.y)
        return {"y": y}, {"y": y}


class Full(Estimator):
    """Wrong about its range, and not judged."""

    inputs = (Input("u", -1.0, 1.0, ""),)
    outputs = (Output("y", ""),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Twice."""
        return {}, {"y": ops.bounded(2.0 * u.u, -1.5, 1.5, "it is not")}


def checked() -> CheckResult:
    build = Build(Low(), params=[{"gain": 0.03}])
    u = 0.9 * np.sign(np.sin(0.05 * np.arange(400)))
    (check,) = Check(build, levels=("fixed",)).run(Record.of({"u": u}, name="steps"))
    return check


def test_more_bits_less_error() -> None:
    check, told = checked(), []
    found = width_section(check, (18, 22, 26), progress=told.append)
    assert told == ["W = 18", "W = 22", "W = 26"] and found["dataset"] == "steps"
    errors = [p["outputs"][0]["max"] for p in found["points"]]
    for wide, narrow in zip(errors[1:], errors, strict=False):
        assert 1 / 64 < wide / narrow < 1 / 4
    assert errors[0] > 2.0 * TOLERANCE > 4.0 * errors[1]
    assert [p["good"] for p in found["points"]] == [e <= TOLERANCE for e in errors]
    assert [p["good"] for p in found["points"]] == [False, True, True]
    assert found["least_good"] == 22
    assert all(p["saturated_updates"] == 0 and not p["error"] for p in found["points"])
    # The width of the run itself is the run itself.
    (same,) = width_section(check, (32,))["points"]
    assert same["outputs"] == [d.to_json() for d in check.accuracy.differences]


def test_a_good_width_below_a_bad_one_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    good = {18: False, 20: True, 22: False, 24: True, 26: True}
    monkeypatch.setattr(module, "_point", lambda check, width: {"good": good[width]})
    assert width_section(checked(), tuple(good))["least_good"] == 24
    assert width_section(checked(), (18, 20, 22))["least_good"] is None


def test_what_saturates_is_not_good() -> None:
    build = Build(Full())
    (check,) = Check(build, levels=("fixed",)).run(Record.of({"u": np.array([0.5, 1.0, 1.0])}))
    (point,) = width_section(check, (20,))["points"]
    assert point["saturated_updates"] == 2 and not point["good"]


def test_what_does_not_compile_says_why() -> None:
    (point,) = width_section(checked(), (17,))["points"]
    assert point == {
        "word": 17,
        "good": False,
        "error": point["error"],
        "saturated_updates": None,
        "outputs": [],
    }
    assert point["error"]
