"""The text of `boresight accuracy` for figures made by hand; test_accuracy.py runs it for real."""

from __future__ import annotations

from typing import Any

from boresight.accuracy_text import accuracy_text
from boresight.sim.compare.difference import ATTITUDE


def trial(name: str, **error: float) -> dict[str, Any]:
    return {"trial": name, "error": error}


def log(name: str, reference: str = "truth") -> dict[str, Any]:
    return {"trial": name, "reference": reference}


def attitude(name: str, total: float | None, **more: Any) -> dict[str, Any]:
    mean = None if total is None else {"total": total, "heading": 2.0, "inclination": 0.5}
    return {
        **{"estimator": name, "level": "published", "kind": "published", "attitude": True},
        **{"mean": mean, "mean_by_folder": {"f": mean}, "vs_float": [], "saturated_updates": 0},
        **{"trials": [trial("a", total=1.25), trial("b", total=2.5)], **more},
    }


OURS = attitude(
    "mine",
    1.88,
    level="fixed",
    kind="ours",
    saturated_updates=1234,
    vs_float=[
        {"output": ATTITUDE, "apart": 1.5e-5, "unit": "deg", "tolerance": 0.01, "good": True},
        {"output": "status", "apart": 7.0, "unit": "bits", "tolerance": None, "good": True},
    ],
)
FLOAT = attitude("mine", 1.9, level="float", kind="ours")


def text(*rows: dict[str, Any], logs: Any = None, left_out: tuple[str, ...] = ()) -> list[str]:
    logs = [log("a"), log("b")] if logs is None else logs
    data = {"word": 28, "estimators": list(rows), "logs": logs, "left_out": list(left_out)}
    return accuracy_text(data).splitlines()


def test_attitudes_side_by_side() -> None:
    lines = text(OURS, FLOAT, attitude("other", None), left_out=("x", "y"))
    assert lines[0].startswith("RMSE in degrees, mean over 2 trials with truth.")
    assert "W = 28" in lines[0]
    rows = {line.split()[1]: line.split()[2:] for line in lines if line.startswith("   [")}
    assert rows["mine"] == ["1.88", "2.00", "0.50", "1.90", "0.000015", "7", "1,234"]
    assert rows["other"] == ["-", "-", "-"]
    assert lines[-1] == "left out, no reference: x, y"
    at = lines.index("Total RMSE by trial, degrees")
    assert [line.split() for line in lines[at + 1 : at + 4]] == [
        ["[1]", "[2]"],
        ["a", "1.25", "1.25"],
        ["b", "2.50", "2.50"],
    ]
    assert not any("by folder" in line or "BEYOND" in line for line in lines)


def test_folders_only_if_there_are_several() -> None:
    means = {"f": {"total": 1.0}, "g": None}
    lines = text({**OURS, "mean_by_folder": means})
    at = lines.index("Total RMSE, mean by folder, degrees")
    assert [line.split() for line in lines[at + 2 : at + 4]] == [["f", "1.00"], ["g", "-"]]


def test_what_is_not_truth_stands_apart() -> None:
    logs = [log("a"), log("b", "comparison")]
    lines = text(OURS, logs=logs)
    assert lines[0].startswith("RMSE in degrees, mean over 1 trial with truth.")
    at = lines.index("Not truth, outside the means: against the log's comparison")
    assert lines[at + 2].split() == ["b", "2.50"]
    lines = text(OURS, attitude("ref", 1.0), logs=[log("a", "ref"), log("b")])
    at = lines.index("No reference, outside the means: difference to ref")
    assert lines[at + 2].split() == ["a", "1.25", "-"]  # not measured against itself


def test_an_attitude_beyond_its_tolerance_is_named() -> None:
    beyond = {"output": ATTITUDE, "apart": 0.02, "unit": "deg", "tolerance": 0.01, "good": False}
    lines = text({**OURS, "vs_float": [beyond]})
    assert lines[-1] == f"mine, {ATTITUDE}: 0.02 deg from float64, BEYOND 0.01"


def test_other_estimators_output_by_output() -> None:
    row = {
        **{"estimator": "lag", "level": "fixed", "kind": "ours", "attitude": False},
        **{"units": {"y": "m"}, "mean": {"y": 0.123456}, "saturated_updates": 5},
        "trials": [trial("a", y=0.1), trial("b")],
        "vs_float": [
            {"output": "y", "apart": 2e-6, "unit": "m", "tolerance": 1e-6, "good": False},
            {"output": "v", "apart": 3.0, "unit": "m/s", "tolerance": None, "good": True},
        ],
    }
    lines = text(row, {**row, "level": "float", "mean": {"y": 0.5}})
    assert lines[0].startswith(
        "lag, W = 28: root mean square error against truth, mean over 2 logs; "
    )
    assert "updates that saturated: 5" in lines[1]
    assert [line.split() for line in lines[3:]] == [
        ["y", "m", "0.1235", "0.5", "2e-06", "1e-06", "BEYOND"],
        ["v", "m/s", "-", "-", "3", "-"],
        ["a:", "y", "0.1"],
        ["b:", "no", "truth"],
    ]
