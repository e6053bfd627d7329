"""`sim.report.accuracy` against direct computation."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from boresight.model.attitude import estimator
from boresight.model.declarations import QUATERNION
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.compare import check as module
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record
from boresight.sim.report.accuracy import ANGLES, BINS, accuracy_section, worst_output
from boresight.sim.report.observed import Observed
from boresight.sim.report.widths import width_section
from boresight.sim.rotations.accuracy import attitude_rmse
from boresight.sim.rotations.outputs import attitude_of, euler_deg_of


def section(check: CheckResult | None, *, truth: bool = True) -> tuple[dict[str, Any], list[str]]:
    warnings: list[str] = []
    checks = [] if check is None else [check]
    return accuracy_section(checks, warnings.append, truth=truth), warnings


def test_figures(checked: CheckResult) -> None:
    result, warnings = section(checked)
    assert warnings == []
    fixed, reference = checked.fixed.outputs, checked.floating.outputs
    error = np.abs(euler_deg_of(fixed) - euler_deg_of(reference))
    error = np.minimum(error, 360.0 - error).max(axis=1)
    assert result["vs_float_max_deg"] == pytest.approx(error.max(), rel=1e-5)
    assert result["vs_float_max_sample"] == int(error.argmax())
    q = attitude_of(checked.given.truth)
    rmse = attitude_rmse(attitude_of(fixed), q)
    assert result["rmse_deg"] == pytest.approx(rmse._asdict(), rel=1e-5)
    assert result["float_rmse_deg"]["total"] == pytest.approx(rmse.total, rel=1e-4)
    assert (result["dataset"], result["samples"]) == ("synthetic_60s", 300)
    assert result["seconds"] == pytest.approx(2.99)
    assert result["reference"] == "truth"
    assert section(checked, truth=False)[0]["reference"] == "comparison"
    assert result["verdict"] == checked.accuracy.to_json()


def test_curves(checked: CheckResult) -> None:
    series = section(checked)[0]["logs"][0]["series"]
    assert series["samples_per_point"] == 1 and series["t"][:2] == [0.0, 0.01]
    for k, name in enumerate(ANGLES):
        curve = series["outputs"][name]
        euler = euler_deg_of(checked.fixed.outputs)[:, k]
        np.testing.assert_allclose(curve["fixed"], euler, rtol=1e-4, atol=1e-4)
        # The truth has the angles in the same order as the outputs.
        assert abs(curve["truth"][-1] - curve["fixed"][-1]) < 6.0
        assert curve["unit"] == "deg" and curve["tolerance"] is None
    shown = {name: o["unit"] for name, o in series["outputs"].items()}
    assert shown["qw"] == "" and shown["status"] == "bits" and shown["attitude"] == "deg"
    (qw,) = (d for d in checked.accuracy.differences if d.output == "qw")
    assert max(series["outputs"]["qw"]["error"]) == pytest.approx(qw.largest, rel=1e-4)
    assert series["outputs"]["qw"]["tolerance"] == qw.tolerance == 5e-5


class Heading(Estimator):
    """Any outputs: an angle, something that is known, and a word."""

    inputs = (Input("u", -1.0, 1.0, "ht"), Input("v", -4.0, 4.0, "m"))
    states = (State("held", -4.0, 4.0, "m"),)
    outputs = (
        Output("angle", "ht", tolerance=1e-6),
        Output("held", "m", tolerance=1e-6),
        Output("word", "bits"),
    )

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """As they are."""
        return {"held": u.v}, {"angle": 1.0 * u.u, "held": x.held, "word": 0.0 * u.v + 1.0}


def looked_at(n: int, **more: Any) -> CheckResult:
    columns = {"u": np.linspace(-0.5, 0.5, n), "v": np.sin(np.arange(n))} | more
    (check,) = Check(Build(Heading()), levels=("fixed",)).run(Record.of(columns))
    return check


def test_long_logs_are_binned_without_losing_peaks() -> None:
    check = looked_at(4999)
    errors = [d.apart.copy() for d in check.accuracy.differences]
    errors[0][1234] = 0.25
    accuracy = dataclasses.replace(
        check.accuracy,
        differences=tuple(
            dataclasses.replace(d, apart=x)
            for d, x in zip(check.accuracy.differences, errors, strict=True)
        ),
    )
    result, warnings = section(dataclasses.replace(check, accuracy=accuracy))
    series = result["logs"][0]["series"]
    assert len(series["t"]) <= BINS and series["samples_per_point"] == 5
    assert max(series["outputs"]["angle"]["error"]) == 45.0
    assert series["outputs"]["angle"]["error"].index(45.0) == 1234 // 5
    assert series["outputs"]["angle"]["tolerance"] == pytest.approx(1.8e-4)
    assert result["seconds"] is None and series["t"][1] == 5.0  # samples
    assert warnings == []


def test_a_point_is_an_envelope() -> None:
    """Mean, least and greatest of its samples; what has no mean shows its first."""
    rng = np.random.default_rng(1)
    wild, round_ = rng.normal(0.0, 1.0, 4999), np.linspace(0.0, 7.9, 4999) % 2.0 - 1.0
    check = looked_at(4999, v=wild, u=round_)
    outputs = section(check)[0]["logs"][0]["series"]["outputs"]
    held, angle, word = outputs["held"], outputs["angle"], outputs["word"]
    fixed = np.append(check.fixed.outputs["held"], np.nan).reshape(-1, 5)
    for name, pick in (("fixed", np.nanmean), ("low", np.nanmin), ("high", np.nanmax)):
        np.testing.assert_allclose(held[name], pick(fixed, axis=1), rtol=1e-4, atol=1e-5)
    # The angle passes half a turn within a point.
    turn = int(np.argmax(np.array(angle["high"]) - angle["low"]))
    assert angle["high"][turn] - angle["low"][turn] > 350.0 and abs(angle["fixed"][turn]) > 170.0
    assert set(word["fixed"]) == {1.0}
    assert "low" not in section(looked_at(900))[0]["logs"][0]["series"]["outputs"]["held"]


def test_a_log_in_pieces_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures, curves, extremes and rounding, where no rows are kept."""
    record = read_record(bundled("synthetic_60s")).head(2750)
    build = Build(estimator("complementary"), word=20)  # parts from float64
    (whole,) = Check(build, levels=("c",)).run(record)
    monkeypatch.setattr(module, "KEPT", 256)
    (short,) = Check(build, levels=("c",)).run(record, keep_all=False)
    assert len(short.given) == 256 and short.rows == whole.rows == 2750
    wanted, result = section(whole), section(short)
    assert result[1] == wanted[1] and any("BEYOND" in text for text in wanted[1])
    for log in (wanted[0]["logs"][0], result[0]["logs"][0]):
        assert log["parted"]["t"] == pytest.approx(0.01 * log["parted"]["sample"])
        for curve in log["series"]["outputs"].values():  # sums in another order
            curve["fixed"] = [
                None if x is None else float(f"{x:.4g}") for x in curve["fixed"] or ()
            ]
            curve["truth"] = [
                None if x is None else float(f"{x:.4g}") for x in curve["truth"] or ()
            ]
    assert result[0] == wanted[0]
    seen, every = (Observed.of(build.programs[0], [check]) for check in (short, whole))
    assert seen.summary == every.summary
    assert all(np.array_equal(a, b) for a, b in zip(seen.ranges[0], every.ranges[0], strict=True))
    for n, error in every.errors.items():
        assert (seen.errors[n].largest, seen.errors[n].samples) == (error.largest, error.samples)
        assert seen.errors[n].squares == pytest.approx(error.squares, rel=1e-12)
    assert width_section(short, (18, 32)) == width_section(whole, (18, 32))


def moved(check: CheckResult, **steps: int) -> CheckResult:
    """With an error of 1 of some outputs from a step on."""
    errors = []
    for d in check.accuracy.differences:
        curve = d.apart.copy()
        if d.output in steps:
            curve[steps[d.output] :] = 1.0
        largest = float(curve.max())
        beyond = steps.get(d.output, 0)
        errors.append(dataclasses.replace(d, apart=curve, largest=largest, beyond=beyond))
    accuracy = dataclasses.replace(check.accuracy, differences=tuple(errors), culprit="step 7")
    accuracy = dataclasses.replace(accuracy, saturated_updates=2, saturated={"y": 2})
    return dataclasses.replace(check, accuracy=accuracy)


def test_where_fixed_and_float_part() -> None:
    check = looked_at(20, t=0.5 * np.arange(20))
    (log,) = section(check)[0]["logs"]
    assert log["parted"] is None
    assert {o["beyond_from"] for o in log["series"]["outputs"].values()} == {None}
    (log,) = section(moved(check, held=7, angle=9))[0]["logs"]
    assert log["parted"] == {"sample": 7, "t": 3.5, "outputs": ["held"], "culprit": "step 7"}
    begins = {name: o["beyond_from"] for name, o in log["series"]["outputs"].items()}
    assert begins == {"angle": 4.5, "held": 3.5, "word": None}
    (log,) = section(moved(check, held=9, angle=9))[0]["logs"]
    assert log["parted"]["outputs"] == ["angle", "held"]


def test_several_logs() -> None:
    good, bad = looked_at(20), moved(looked_at(30), held=7)
    warnings: list[str] = []
    result = accuracy_section([good, bad], warnings.append, truth=True)
    assert [log["samples"] for log in result["logs"]] == [20, 30]
    assert result["samples"] == 30  # the worst one's
    verdict = result["verdict"]
    assert not verdict["good"] and verdict["culprit"] == "record: step 7"
    assert [o["output"] for o in verdict["outputs"]] == ["angle", "held", "word"]
    assert verdict["outputs"][1]["max"] == 1.0 and not verdict["outputs"][1]["good"]
    assert (verdict["saturated_updates"], verdict["saturated"]) == (2, {"y": 2})
    twice = accuracy_section([bad, bad], [].append, truth=True)["verdict"]
    assert (twice["saturated_updates"], twice["saturated"]) == (4, {"y": 4})
    assert all(w.startswith("accuracy, record: ") for w in warnings) and len(warnings) == 3
    assert accuracy_section([good, good], warnings.append, truth=True)["verdict"]["good"]


def test_the_worst_output_uses_most_of_its_tolerance() -> None:
    rows = [
        {"max": 5.0, "tolerance": None},
        {"max": 1.0, "tolerance": 2.0},
        {"max": 0.6, "tolerance": 1.0},
        {"max": 0.0, "tolerance": 0.0},
    ]
    assert worst_output(rows) is rows[2]
    assert worst_output(rows[:1]) is rows[0]
    none = {"max": None, "tolerance": 1.0}
    assert worst_output([*rows, none]) is none


def test_truths_of_any_outputs() -> None:
    held = np.append(0.0, np.sin(np.arange(99)))
    check = looked_at(100, held_true=held + 0.5, t=0.1 * np.arange(100))
    result, _ = section(check)
    (row,) = result["truth"]
    assert (row["output"], row["unit"], row["samples"], row["tolerance"]) == (
        "held",
        "m",
        100,
        None,
    )
    assert row["max"] == pytest.approx(0.5, abs=1e-6) and row["float_rms"] == pytest.approx(0.5)
    curves = result["logs"][0]["series"]["outputs"]
    assert curves["held"]["truth"][0] == 0.5 and curves["angle"]["truth"] is None
    assert result["reference"] == "truth" and result["rmse_deg"] is None
    assert result["vs_float_max_deg"] is None and result["logs"][0]["series"]["vs_log_deg"] is None


def test_gaps_in_the_reference_are_null(checked: CheckResult) -> None:
    truth = {n: v.copy() for n, v in checked.given.truth.items()}
    for name in QUATERNION:
        truth[name][10:20] = np.nan
    values = dataclasses.replace(checked.given, truth=truth)
    result, _ = section(dataclasses.replace(checked, given=values))
    series = result["logs"][0]["series"]
    for curve in (series["vs_log_deg"]["heading"], series["outputs"]["roll"]["truth"]):
        assert [k for k, v in enumerate(curve) if v is None] == list(range(10, 20))
    assert result["rmse_deg"]["total"] > 0


def test_missing_parts_are_null_and_named(checked: CheckResult) -> None:
    result, warnings = section(None)
    assert warnings == ["accuracy: no log was run"]
    assert result.pop("logs") == [] and set(result.values()) == {None}
    values = dataclasses.replace(checked.given, truth={})
    result, warnings = section(dataclasses.replace(checked, given=values))
    assert warnings == ["accuracy: synthetic_60s has no attitude to compare with"]
    assert result["reference"] is None and result["truth"] == [] and result["rmse_deg"] is None
    assert result["vs_float_attitude_max_deg"] > 0.0
