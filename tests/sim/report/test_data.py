"""The report's data: numerics, observed values, sources, times."""

import copy
import dataclasses
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import WordRanges
from boresight.gateware.core import Core
from boresight.gateware.synthesis.routed import Mapped
from boresight.gateware.synthesis.spartan6.family import XC6SLX9
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult, LevelResult
from boresight.sim.compare.twin import Rounding
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.report.against import against_section, read_report
from boresight.sim.report.data import measure_c, report_data
from boresight.sim.report.html import render_html
from boresight.sim.report.numerics import numerics_section
from boresight.sim.report.observed import Observed
from boresight.sim.report.sources import source_of, sources, tool_of
from boresight.sim.report.timing import timing_section

# -- `sim.report.data`: complete, valid JSON, every number with a source, nothing invented --------

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
    "verification.0": [
        "level",
        "simulator",
        "n_total",
        "n_mismatch",
        "reference",
        "seconds",
        "cycles",
    ],
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
        results = dict(numbers({k: v for k, v in data.items() if k != "sources"}))
        assert len(results) > 1000
        assert [path for path in results if not source_of(data, path)] == []
    assert "Yosys 0.70 (git sha1 0123abc): yosys -p synth" in (
        source_of(report, "resources.lut") or ""
    )
    assert "not by ISE" in (source_of(report, "timing.fmax_mhz.-2.p75") or "")
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
    assert t["update_us"] == pytest.approx(latency / 100.0)
    assert t["fmax_mhz"] == {"-2": {"median": 125.0, "p75": 80.0}}
    assert t["update_us_at_fmax"]["-2"]["p75"] == round(latency / 80.0, 3)
    assert t["critical_path"]["delay_ns"] == 12.5
    assert any(
        w.startswith("clock: the estimate at speed 2, p75 nets, is 80 MHz")
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


def test_same_inputs_same_report(core: Core, estimate: Mapped) -> None:
    first, second = (json.dumps(report_data(core, area=estimate)) for _ in range(2))
    assert first == second
    assert all(math.isfinite(x) for _, x in numbers(json.loads(first)))


def test_from_a_check(core: Core, estimate: Mapped, checked: CheckResult) -> None:
    data = report_data(core, checked, area=estimate, comparison=True)
    assert [(v["level"], v["n_total"], v["good"]) for v in data["verification"]] == [
        ("fixed", 300, True),
        ("c", 300, True),
    ]
    assert data["accuracy"]["reference"] == "comparison"
    errors = [checked.accuracy.largest(name) or 0.0 for name in ("pitch", "roll", "heading")]
    assert data["accuracy"]["vs_float_max_deg"] == pytest.approx(180.0 * max(errors), rel=1e-5)
    row = next(r for r in data["numerics"] if r["signal"] == "az")
    assert row["observed_max"]["log"] == "synthetic_60s" and row["observed_max"]["sample"] < 300
    assert data["firmware"]["updates_per_s"] > 1000
    assert "300 updates" in (source_of(data, "firmware.updates_per_s") or "")
    assert not any(w.startswith(("numerics", "accuracy", "firmware")) for w in data["warnings"])


def test_rate_of_the_c(core: Core, check: CheckResult) -> None:
    result = measure_c(core.program, check.given.words(core.program), seconds=0.001)
    assert result["updates_per_s"] > 1000 and result["source"].startswith("measured: ")


# -- `sim.report.numerics`: rows of the values, and when they ask for attention -------------------


@pytest.fixture(scope="module")
def observed(core: Core, check: CheckResult) -> Observed:
    value = core.program.find("residual")
    lsb = core.program.format(value).lsb
    result = Observed.of(core.program, [check])
    return dataclasses.replace(result, errors={value: Rounding(1.23456 * lsb, 8.0 * lsb**2, 2)})


def test_a_row_for_every_value_but_constants(core: Core, observed: Observed) -> None:
    program = core.program
    rows = numerics_section(program, observed)
    numbers = [n for n, v in enumerate(program.values) if v.kind is not Kind.CONST]
    assert [r["signal"] for r in rows] == [program.values[n].name for n in numbers]
    for n, row in zip(numbers, rows, strict=True):
        low, high, low_at, high_at, saturations = (int(x[n]) for x in observed.ranges[0])
        assert row["format"] == str(program.format(n))
        for end, word, at in (("min", low, low_at), ("max", high, high_at)):
            seen = row[f"observed_{end}"]
            assert seen["log"] == "synthetic_60s" and seen["sample"] == at
            assert seen["value"] == pytest.approx(program.format(n).real(word), rel=1e-6)
        assert row["saturations"] == saturations
        assert row["error_lsb"] == (1.23 if row["signal"] == "residual" else None)
        assert row["line"] == observed.lines.get(n)
        if row["signal"] == "residual":
            lsb = program.format(n).lsb
            assert row["error_max"] == pytest.approx(1.23456 * lsb, rel=1e-6)
            assert row["error_rms"] == pytest.approx(2.0 * lsb, rel=1e-6)
        blank = row["overflow"] == "WRAP" or row["kind"] == "param"
        assert (row["headroom_bits"] is None) == blank
        if not blank:  # so many times it doubles and still fits
            largest, limit = max(-low, high + 1, 1), 1 << (program.arithmetic.word - 1)
            assert row["wasted_bits"] in (None, int(observed.headroom_bits(n)) - 2)
            assert largest * 2 ** row["headroom_bits"] == pytest.approx(limit, rel=0.004)
    heading = next(r for r in rows if r["signal"] == "heading_ht")
    assert (heading["overflow"], heading["state"], heading["unit"]) == ("WRAP", "wraps", "ht")
    assert [r["output"] for r in rows if r["output"]] == [
        name for _, name in sorted(zip(program.outputs, program.output_names, strict=True))
    ]


def test_without_a_log_nothing_is_observed(core: Core) -> None:
    for row in numerics_section(core.program, None):
        assert row["state"] in ("ok", "wraps")
        assert row["range_source"]
        for key in ("observed_min", "observed_max", "headroom_bits", "error_lsb", "saturations"):
            assert row["line"] is None and row["advice"] is None
            assert row[key] is None


def test_attention(core: Core, observed: Observed) -> None:
    program = core.program

    def state(name: str, word: int, saturations: int = 0) -> str:
        n, ranges = program.find(name), [x.copy() for x in observed.ranges[0]]
        ranges[1][n], ranges[4][n] = word, saturations
        changed = dataclasses.replace(observed, ranges=[WordRanges(*ranges)])
        return next(r["state"] for r in numerics_section(program, changed) if r["signal"] == name)

    assert state("gx", 2**30 - 1) == "ok"
    assert state("gx", 2**31 - 1) == "tight"
    proven = next(
        program.values[op.dest].name
        for op in program.ops
        if program.values[op.dest].range_source == "interval" and op.overflow.value == "SAT"
    )
    assert state(proven, 2**31 - 1) == "ok"
    assert state(proven, 2**31 - 1, saturations=3) == "saturated"
    modes = {op.dest: op.overflow.value for op in program.ops}
    claimed = next(
        n
        for n, v in enumerate(program.values)
        if modes.get(n) == "SAT" and v.range_source.startswith("declared:") and v.high > 0
    )
    value = program.values[claimed]
    assert state(value.name, 2**31 - 3) == "tight"
    # The declared end itself, not clamped: that is what the range says.
    assert state("mx", int(program.format(program.find("mx")).quantise(255.9))) == "tight"
    flag = program.find("unknown")
    least = program.format(flag).real(int(observed.ranges[0].low[flag]))
    assert least == program.values[flag].low == -2.0
    assert state("unknown", 0) == "ok"


# -- what a log did to every value, against the interpreter ---------------------------------------


def test_extremes_are_those_of_the_interpreter(core: Core, check: CheckResult) -> None:
    result, machine = Observed.of(core.program, [check]), Interpreter(core.program)
    words_of_log = result.words
    assert result.logs == ["synthetic_60s"] and len(words_of_log) == 300
    assert result.summary == "300 updates of synthetic_60s"
    rows = []
    for row in words_of_log:
        machine.update(row[:, None])
        rows.append([int(w[0]) for w in machine.values_before_commit()])
    words = np.array(rows)
    (ranges,) = result.ranges
    assert np.array_equal(ranges.low, words.min(axis=0))
    assert np.array_equal(ranges.high_at, words.argmax(axis=0))
    assert result.errors and all(e.samples == 300 for e in result.errors.values())
    value = core.program.find("residual")
    form = core.program.format(value)
    assert 0.0 < result.errors[value].largest < 64.0 * form.lsb
    assert result.reached(value) == (
        form.real(words[:, value].min()),
        form.real(words[:, value].max()),
    )
    assert result.lines[core.program.find("gx")].startswith("complementary.py, line ")
    assert result.lines[value].startswith("complementary.py, line ")


class Sum(Estimator):
    """Saturates at 4."""

    inputs = (Input("u", -1.0, 1.0, ""),)
    states = (State("y", -4.0, 4.0, ""),)
    outputs = (Output("y", ""),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Sum."""
        return {"y": x.y + u.u}, {"y": x.y}


def test_several_logs_each_from_a_reset_on() -> None:
    build = Build(Sum())
    checking = Check(build, levels=("fixed",))
    logs = {"up": [1.0] * 6, "again": [1.0] * 6, "down": [0.5, -1.0, -0.5]}
    checks = [checking.run(Record.of({"u": np.array(u)}, name=name))[0] for name, u in logs.items()]
    (program,) = build.programs
    result = Observed.of(program, checks)
    state = program.find("y")
    after = dict(program.states)[state]
    low, high = result.extremes(program.find("u"))
    assert (low.log, low.sample, high.log, high.sample) == ("down", 1, "up", 0)
    assert result.reached(state) == (-0.5, 5.0)
    # The word ends at 8, twice the range: nothing saturates unless states go on to the next log.
    assert result.saturations(after) == 0
    assert result.reached(after) == (-1.0, 6.0)
    assert all(e.samples == 15 for e in result.errors.values()) and result.errors
    assert result.summary == "6 updates of up, 6 updates of again, 3 updates of down"


@pytest.mark.parametrize(
    ("low", "high", "bits"), [(0, 0, 31), (0, 1, 30), (-1, 0, 31), (-2, 1, 30), (-5, 2**30 - 1, 1)]
)
def test_headroom(low: int, high: int, bits: float, core: Core, check: CheckResult) -> None:
    result = Observed.of(core.program, [check])
    result.ranges[0].low[3], result.ranges[0].high[3] = low, high
    assert result.headroom_bits(3) == bits


# -- `sim.report.sources`: the nearest named ancestor, and what the tool is called ----------------


def test_nearest_ancestor() -> None:
    data = {"sources": {"a": "all of it", "a.b.c": "this one"}}
    assert source_of(data, "a.b.c.0") == source_of(data, "a.b.c") == "this one"
    assert source_of(data, "a.b") == source_of(data, "a.b.cd") == "all of it"
    assert source_of(data, "b") is None


def test_tool(estimate: Mapped) -> None:
    assert tool_of(estimate) == "Yosys 0.70 (git sha1 0123abc)"
    assert tool_of(dataclasses.replace(estimate, version="Yosys 0.9")) == "Yosys 0.9"


def test_only_what_there_is(estimate: Mapped) -> None:
    data = {"firmware": {"source": None}}
    bare = sources(data, None, "", XC6SLX9)
    assert "resources" not in bare and "firmware.updates_per_s" not in bare
    assert bare["numerics"] == "range: compiled (range_source)"
    full = sources({"firmware": {"source": "a clock"}}, estimate, "9 updates of a log", XC6SLX9)
    assert full["firmware.updates_per_s"] == "a clock"
    assert full["numerics"].endswith("measured on the C model, 9 updates of a log")
    assert full["resources"].endswith("yosys -p synth")


# -- `sim.report.timing`: cycles counted over levels, clocks by grade and nets --------------------


def section(core: Core, *levels: LevelResult, **more: Any) -> tuple[dict[str, Any], list[str]]:
    warnings: list[str] = []
    options = {"area": None, "clock_mhz": 100.0, "grade": 2} | more
    return timing_section(core, levels=levels, warn=warnings.append, **options), warnings


def level(least: int, most: int, interval: int, error: str = "") -> LevelResult:
    counted = {"cycles_min": least, "cycles_max": most, "interval_max": interval}
    return LevelResult("rtl", "verilator", 9, 0, 1.0, 5, error=error, **counted)


def test_counts_are_those_of_all_levels_that_ran(core: Core) -> None:
    plain = LevelResult("c", "gcc", 9, 0, 1.0)
    broken = level(1, 999, 999, "broken")
    result, warnings = section(core, plain, level(200, 210, 300), level(190, 205, 310), broken)
    assert result["latency_cycles"] == {
        "predicted": core.schedule.latency, "min": 190, "max": 210,
    }  # fmt: skip
    assert result["interval_cycles_counted"] == 310
    assert warnings == [f"cycles: predicted {core.schedule.latency}, counted 190 to 210"]
    assert result["critical_path"] is None and result["fmax_mhz"] is None


def test_a_rate_makes_the_core_busy(core: Core) -> None:
    period = core.schedule.interval / 100e6
    result, warnings = section(core, rate_hz=0.25 / period)
    assert result["busy_percent"] == pytest.approx(25.0)
    assert not [w for w in warnings if w.startswith("interval")]
    result, warnings = section(core, rate_hz=1.01 / period)
    assert result["busy_percent"] == pytest.approx(101.0)
    assert [w for w in warnings if w.startswith("interval: ") and "longer than" in w]
    assert section(core)[0]["busy_percent"] is None


def test_slots_by_source_line(report: dict[str, Any]) -> None:
    lines = report["schedule"]["lines"]
    counts = [row["slots"] for row in lines]
    assert (
        counts == sorted(counts, reverse=True)
        and 0 < sum(counts) <= (report["schedule"]["slots_total"])
    )
    assert any("complementary.py, line " in (row["line"] or "") for row in lines)
    assert report["timing"]["rate_hz"] == 100.0


# -- two reports side by side ---------------------------------------------------------------------


def test_the_same_run_twice(report: dict[str, Any]) -> None:
    result = against_section(report, report)
    assert result["rows"] == [] and result["equal"] > 50
    assert result["before"]["digest"] == report["digest"]


def test_what_differs_has_its_row(report: dict[str, Any]) -> None:
    after = copy.deepcopy(report)
    latency = after["timing"]["latency_cycles_by_output"]
    latency["roll"] *= 2
    after["resources"]["lut"] = None
    after["config"] = "small"
    after["timing"]["fmax_mhz"]["-2"]["p75"] = 100.0
    after["accuracy"]["verdict"]["outputs"][0]["max"] = 0.0
    row = next(r for r in after["numerics"] if r["signal"] == "gx")
    row["format"] = "fixed<32,-3>"
    result = against_section(report, after)
    rows = {r["figure"]: (r["before"], r["after"], r["ratio"]) for r in result["rows"]}
    output = report["accuracy"]["verdict"]["outputs"][0]
    cycles = report["timing"]["latency_cycles_by_output"]["roll"]
    assert rows == {
        "roll: latency": (cycles, 2 * cycles, 2.0),
        "LUT": (803, None, None),
        "configuration": ("fast", "small", None),
        "-2: clock, slow nets": (80.0, 100.0, 1.25),
        f"{output['output']}: largest error": (output["max"], 0.0, None),
        "gx: format": ("fixed<32,7>", "fixed<32,-3>", None),
    }
    assert result["equal"] == against_section(report, report)["equal"] - len(rows)


def test_what_only_one_report_has(report: dict[str, Any], core: Core) -> None:
    rows = against_section(report_data(core), report)["rows"]
    new = {r["figure"]: (r["before"], r["after"]) for r in rows}
    assert new["DSP"] == (None, 8) and new["-2: clock, slow nets"] == (None, 80.0)
    assert new["updates that saturated"] == (None, 0)
    assert any(name.startswith("synthetic_60s, ") and "truth" in name for name in new)


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
