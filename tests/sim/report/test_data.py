"""`sim.report.data`: complete, valid JSON, every number with a source, nothing invented."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.gateware.synthesis.estimate import Estimate
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult, LevelResult
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.report.data import measure_c, report_data
from boresight.sim.report.html import render_html
from boresight.sim.report.sources import source_of

#: The fields of the contract.
FIELDS = {
    "": [
        "design",
        "config",
        "word",
        "digest",
        "target",
        "timing",
        "resources",
        "schedule",
        "numerics",
        "accuracy",
        "verification",
        "firmware",
        "warnings",
    ],
    "target": ["device", "speed", "clock_mhz"],
    "timing": [
        "latency_cycles",
        "latency_cycles_by_output",
        "interval_cycles",
        "update_us",
        "paper_us",
        "paper_cycles",
        "speedup",
        "fmax_mhz",
        "source",
    ],
    "timing.latency_cycles": ["predicted", "min", "max"],
    "resources": ["lut", "reg", "dsp", "blkmem", "percent", "source", "command"],
    "schedule": ["units", "ops_total", "slots_total", "chart"],
    "schedule.units.0": ["op", "count", "busy_cycles", "utilisation"],
    "numerics.0": [
        "signal",
        "unit",
        "format",
        "min",
        "max",
        "range_source",
        "observed_min",
        "observed_max",
        "headroom_bits",
        "saturations",
    ],
    "accuracy": ["dataset", "vs_float_max_deg", "rmse_deg"],
    "verification.0": ["level", "simulator", "n_total", "n_mismatch", "seconds", "cycles"],
    "firmware": ["lines", "bytes", "updates_per_s"],
}


def at(data: Any, path: str) -> Any:
    for key in path.split(".") if path else ():
        data = data[int(key)] if isinstance(data, list) else data[key]
    return data


def numbers(data: Any, path: str = "") -> Iterator[tuple[str, float]]:
    items = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data)
        if isinstance(data, list)
        else ()
    )
    for key, value in items:
        yield from numbers(value, f"{path}.{key}" if path else str(key))
    if isinstance(data, int | float) and not isinstance(data, bool):
        yield path, data


def test_complete_and_plain_json(report: dict[str, Any], core: Core) -> None:
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    for path, keys in FIELDS.items():
        assert set(keys) <= set(at(report, path)), path
    assert report["digest"] == core.program.digest


def test_every_number_has_a_source(report: dict[str, Any], core: Core) -> None:
    for data in (report, report_data(core)):
        found = dict(numbers({k: v for k, v in data.items() if k != "sources"}))
        assert len(found) > 1000
        assert [path for path in found if not source_of(data, path)] == []
    assert "estimate, Yosys 0.70 (git sha1 0123abc): yosys -p synth" in (
        source_of(report, "resources.lut") or ""
    )
    assert "sign-off needs trce" in (source_of(report, "timing.fmax_mhz.-2.p75") or "")
    assert source_of(report, "timing.latency_cycles.max") == "measured: boresight check"
    assert source_of(report, "timing.latency_cycles.predicted") != source_of(
        report, "timing.latency_cycles.max"
    )
    assert source_of(report, "no.such.number") is None


def test_timing(report: dict[str, Any], core: Core) -> None:
    t, latency = report["timing"], core.schedule.latency
    assert t["latency_cycles"] == {"predicted": latency, "min": latency, "max": latency}
    assert list(t["latency_cycles_by_output"].values()) == list(core.schedule.latencies)
    assert t["interval_cycles"] == t["interval_cycles_counted"] == core.schedule.interval
    assert (t["paper_us"], t["paper_cycles"]) == (316.0, 31600)
    assert t["update_us"] == pytest.approx(latency / 100.0)
    assert t["speedup"] == pytest.approx(31600 / latency, abs=0.05)
    assert t["fmax_mhz"] == {
        "-2": {"median": 125.0, "p75": 80.0},
        "-3": {"median": 142.8, "p75": 90.9},
    }
    assert t["update_us_at_fmax"]["-2"]["p75"] == round(latency / 80.0, 3)
    assert t["critical_path"]["delay_ns"] == 12.5
    assert t["critical_path"]["points"][0]["guessed"] == ["ramb_clk_do"]
    assert any(
        w.startswith("clock: the estimate at grade -2, upper-quartile nets, is 80 MHz")
        for w in report["warnings"]
    )


def test_resources(report: dict[str, Any]) -> None:
    r = report["resources"]
    assert {k: r[k] for k in ("lut", "reg", "dsp", "blkmem")} == {
        "lut": 803,
        "reg": 507,
        "dsp": 8,
        "blkmem": 11.5,
    }
    assert r["percent"] == {"lut": 14.04, "reg": 4.43, "dsp": 50.0, "blkmem": 35.94}
    assert r["source"].startswith("estimate: ")


def test_what_is_missing_is_null_and_named(core: Core) -> None:
    data = report_data(core)
    t, r = data["timing"], data["resources"]
    assert [r[k] for k in ("lut", "reg", "dsp", "blkmem", "source", "command")] == [None] * 6
    assert set(r["percent"].values()) == {None} and r["more"] == {}
    assert t["fmax_mhz"] is None and t["critical_path"] is None
    assert t["latency_cycles"]["predicted"] == core.schedule.latency
    assert t["latency_cycles"]["min"] is None and t["latency_cycles"]["max"] is None
    assert data["firmware"]["updates_per_s"] is None and data["firmware"]["lines"] > 100
    assert data["warnings"] == [
        "resources and clock: not known, no synthesis was run",
        "numerics: no log was run, ranges are not observed",
        "verification: not run",
        "cycles: predicted by the schedule, not counted in a simulation",
        "accuracy: no log was run",
        "firmware: rate of the C not measured",
    ]
    for part in ("resources", "timing.fmax_mhz"):
        assert part not in data["sources"]


def test_another_filter_has_no_published_time(core: Core) -> None:
    part = dataclasses.replace(
        core.parts[0], program=dataclasses.replace(core.program, name="other")
    )
    other = dataclasses.replace(core, parts=(part,))
    t = report_data(other)["timing"]
    assert t["paper_us"] is None and t["paper_cycles"] is None and t["speedup"] is None


def test_levels_that_failed_are_warned_about(core: Core, check: CheckResult) -> None:
    rtl = check.levels[1]
    levels = (
        LevelResult("c", "gcc", 9, 2, 1.0),
        LevelResult("rtl", "icarus", None, None, 1.0, error="not found"),
        dataclasses.replace(rtl, cycles_max=core.schedule.latency + 1),
        LevelResult("fixed", "interpreter", 0, 0, 0.0),
    )
    data = report_data(core, dataclasses.replace(check, levels=levels))
    assert [v["good"] for v in data["verification"]] == [False] * 4
    assert data["verification"][1]["n_total"] is data["verification"][1]["n_mismatch"] is None
    latency = core.schedule.latency
    for text in (
        "verification: c (gcc) failed: 2 of 9 updates differ",
        "verification: rtl (icarus) failed: not found",
        f"verification: rtl (verilator) failed: cycles predicted {latency}, counted {latency}.."
        f"{latency + 1}",
        f"cycles: predicted {latency}, counted {latency} to {latency + 1}",
    ):
        assert text in data["warnings"]


class Narrow(Estimator):
    """Saturates, leaves its range, and is wrong for it."""

    inputs = (Input("u", -4.0, 4.0, ""),)
    states = (State("y", -1.0, 1.0, ""), State("z", -1.0, 1.0, ""))
    outputs = (Output("y", "", tolerance=1e-6),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Sum."""
        return {"y": x.y + u.u, "z": 0.25 * u.u + 0.25}, {"y": x.y}


def test_what_is_wrong_is_named() -> None:
    build = Build(Narrow())
    record = Record.of({"u": np.array([0.0, 4.0, 4.0])})
    (check,) = Check(build, levels=("fixed",)).run(record)
    data = report_data(build.core, check)
    assert "numerics: 2 saturations, in y_next" in data["warnings"]
    faults = [w for w in data["warnings"] if w.startswith("accuracy: ")]
    assert faults == [f"accuracy: {line}" for line in check.accuracy.faults()]
    assert any("state z is 1.25 in step 1, BEYOND its declared range [-1, 1]" in w for w in faults)
    assert data["accuracy"]["verdict"]["beyond_range"] == list(check.accuracy.beyond_range)
    page = render_html(data)
    assert "State z is 1.25" in page and "2 updates saturated" in page


def test_a_check_of_another_program_is_refused(core: Core, check: CheckResult) -> None:
    other = dataclasses.replace(check, build=Build(Narrow()))
    with pytest.raises(ValueError, match=r"^check must belong to program [0-9a-f]{12}, not "):
        report_data(core, other)


def test_same_inputs_same_report(core: Core, estimate: Estimate) -> None:
    first, second = (json.dumps(report_data(core, area=estimate)) for _ in range(2))
    assert first == second
    assert all(math.isfinite(x) for _, x in numbers(json.loads(first)))


def test_from_a_check(core: Core, estimate: Estimate, checked: CheckResult) -> None:
    data = report_data(core, checked, area=estimate, comparison=True)
    assert [(v["level"], v["n_total"], v["good"]) for v in data["verification"]] == [
        ("fixed", 300, True),
        ("c", 300, True),
    ]
    assert data["accuracy"]["reference"] == "comparison"
    apart = [checked.accuracy.largest(name) or 0.0 for name in ("pitch", "roll", "heading")]
    assert data["accuracy"]["vs_float_max_deg"] == pytest.approx(180.0 * max(apart), rel=1e-5)
    row = next(r for r in data["numerics"] if r["signal"] == "az")
    assert row["observed_max"]["log"] == "synthetic_60s" and row["observed_max"]["sample"] < 300
    assert data["firmware"]["updates_per_s"] > 1000
    assert "300 updates" in (source_of(data, "firmware.updates_per_s") or "")
    assert not any(w.startswith(("numerics", "accuracy", "firmware")) for w in data["warnings"])


def test_rate_of_the_c(core: Core, check: CheckResult) -> None:
    found = measure_c(core.program, check.given.words(core.program), seconds=0.001)
    assert found["updates_per_s"] > 1000 and found["source"].startswith("measured: ")
