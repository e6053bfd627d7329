"""The figures of `boresight accuracy` as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.results.accuracy import (
    AccuracyLog,
    AccuracyNear,
    AccuracyResult,
    AccuracyRow,
    AccuracyTrial,
)


def near(output: str, unit: str, error: float | None, tolerance: float | None) -> AccuracyNear:
    good = tolerance is None or (error is not None and error <= tolerance)
    return AccuracyNear(output, unit, error, tolerance, good)


def row(name: str, level: str, errors: Mapping[str, Any], **more: Any) -> AccuracyRow:
    mean = next(iter(errors.values()))
    values = {
        "kind": "peer" if level == "package" else "ours",
        "summary": name,
        "attitude": "total" in mean,
        "units": dict.fromkeys(mean, "deg" if "total" in mean else "m"),
        "mean": mean,
        "mean_by_folder": {"f": mean},
        "vs_float": (),
        "saturated_updates": None if level == "package" else 1234,
        "seconds": 0.5,
        "trials": tuple(AccuracyTrial(t, e, {}, None) for t, e in errors.items()),
    }
    return AccuracyRow(name, level, **{**values, **more})


def data(
    *rows: AccuracyRow, references: str = "truth", left_out: tuple[str, ...] = ()
) -> AccuracyResult:
    logs = tuple(AccuracyLog(t.trial, 9, 50.0, references, "f") for t in rows[0].trials)
    return AccuracyResult("how", 32, True, logs, left_out, {}, rows)


def angles(total: float | None) -> dict[str, float | None]:
    return {"total": total, "heading": 0.5, "inclination": 0.25}


def test_attitudes_side_by_side() -> None:
    errors = {"one": angles(1.5), "two": angles(2.5)}
    deviations = [near("attitude", "deg", 4.25e-4, 0.01), near("status", "words", 7, 0.0)]
    lines = str(
        data(
            row("mine", "fixed", errors, vs_float=deviations),
            row("mine", "float", {"one": angles(1.75)}),
            row("peer", "package", {"one": angles(9.0), "two": angles(None)}),
            left_out=("gone",),
        )
    ).splitlines()
    assert lines[0].startswith("RMSE in degrees, mean over 2 trials with truth. Ours: fixed")
    assert lines[4].split() == [
        "[1]",
        "mine",
        "1.50",
        "0.50",
        "0.25",
        "1.75",
        "0.000425",
        "7",
        "1,234",
    ]
    assert lines[5].split() == ["[2]", "peer", "9.00", "0.50", "0.25"]
    assert lines[7] == "Total RMSE by trial, degrees"
    assert [x.split() for x in lines[9:11]] == [["one", "1.50", "9.00"], ["two", "2.50", "-"]]
    assert "mine, status: 7 words from float64, BEYOND 0" in lines
    assert lines[-1] == "left out, no reference: gone"
    assert not [x for x in lines if x.startswith("mine, attitude")]


def test_outputs_beside_an_attitude_have_their_table() -> None:
    errors = {"one": angles(1.5) | {"vx": 0.125}}
    deviations = [near("qw", "", 1e-6, 1e-3), near("attitude", "deg", 1e-4, 0.01)]
    deviations += [near("vx", "m/s", 1e-5, 0.01), near("pz", "m", 2e-5, 0.01)]
    lines = str(data(row("ins", "fixed", errors, vs_float=deviations))).splitlines()
    table = [x.split()[0] for x in lines[lines.index("") + 4 :] if x.startswith("  ")]
    assert table[-2:] == ["vx", "pz"] and "qw" not in table and "total" not in table


def test_what_is_no_truth_is_said() -> None:
    shown = row("mine", "fixed", {"one": angles(1.5)}, mean=None)
    for kind, title in (
        ("comparison", "Not truth, outside the means: against the log's comparison"),
        ("vqf", "No reference, outside the means: difference to vqf"),
    ):
        text = str(data(shown, references=kind))
        assert title in text.splitlines() and "mean over 0 trials" in text


def test_other_outputs_one_by_one() -> None:
    errors = {"one": {"pos": 0.125, "vel": 3.0}, "two": {"pos": 0.375}}
    deviations = [
        near("pos", "m", 1e-7, 1e-4),
        near("vel", "m", 2e-3, 1e-3),
        near("word", "words", 0, 0.0),
        near("free", "V", None, None),
    ]
    lines = str(
        data(
            row("cart", "fixed", errors, vs_float=deviations, mean={"pos": 0.25, "vel": 3.0}),
            row("cart", "float", errors, mean={"pos": 0.5, "vel": 3.0}),
        )
    ).splitlines()
    assert lines[0].startswith(
        "cart, W = 32: root mean square error against truth, mean over 2 log"
    )
    assert lines[1].endswith("updates that saturated: 1,234")
    assert [x.split() for x in lines[3:7]] == [
        ["pos", "m", "0.25", "0.5", "1e-07", "0.0001"],
        ["vel", "m", "3", "3", "0.002", "0.001", "BEYOND"],
        ["word", "words", "-", "-", "0", "0"],
        ["free", "V", "-", "-", "-", "-"],
    ]
    assert lines[7:] == ["  one: pos 0.125, vel 3", "  two: pos 0.375"]


def test_one_log_is_not_shown_twice() -> None:
    lines = str(data(row("cart", "fixed", {"one": {"pos": 0.125}}))).splitlines()
    assert "mean over 1 log;" in lines[0] and len(lines) == 4
